//! What stands in the way of a bound.

/// Why there is no bound, and where.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// The image cannot be read.
    #[error("{0}")]
    Image(String),
    /// No function has the name.
    #[error("no function {0}")]
    NoFunction(String),
    /// A call or jump to where no function begins.
    #[error("{function} at {address:#x}: a jump to {target:#x}, where no function begins")]
    NoTarget {
        /// Where from.
        function: String,
        /// Address of the jump.
        address: u32,
        /// Where to.
        target: u32,
    },
    /// Bytes that are no instruction.
    #[error("{function} at {address:#x}: not an instruction")]
    Undecodable {
        /// Where.
        function: String,
        /// Address of the bytes.
        address: u32,
    },
    /// An address in a trace that is no instruction of the image.
    #[error("a trace has {address:#x}, which is no instruction of the image")]
    Untraceable {
        /// The address.
        address: u32,
    },
    /// An instruction without an entry in the table of cycles.
    #[error("{function} at {address:#x}: no cost is known for `{text}`")]
    NoCost {
        /// Where.
        function: String,
        /// Address of the instruction.
        address: u32,
        /// The instruction.
        text: String,
    },
    /// A call or jump through a register, memory or table.
    #[error("{function} at {address:#x}: `{text}` goes where the code does not say")]
    Indirect {
        /// Where.
        function: String,
        /// Address of the instruction.
        address: u32,
        /// The instruction.
        text: String,
    },
    /// A loop without a stated bound.
    #[error("{function} at {address:#x}: a loop without a stated bound; its code is of: {from}")]
    Unbounded {
        /// Where.
        function: String,
        /// Address of the loop's head.
        address: u32,
        /// The functions that the head was inlined from, innermost first.
        from: String,
    },
    /// A call of memcpy or its like with a length that the code does not say and nobody states.
    #[error("{function} at {address:#x}: {callee} of an unknown length")]
    Length {
        /// Where.
        function: String,
        /// Address of the call.
        address: u32,
        /// What is called.
        callee: String,
    },
    /// A jump into the middle of a loop.
    #[error("{function} at {address:#x}: a jump into the middle of a loop")]
    Irreducible {
        /// Where.
        function: String,
        /// Address of the block that is jumped to.
        address: u32,
    },
    /// A function that calls itself, by way of others or not.
    #[error("recursion: {0}")]
    Recursion(String),
    /// The code goes on past the function's end.
    #[error("{function}: the code runs past the function's end")]
    RunsOff {
        /// Which.
        function: String,
    },
    /// No path leads from the entry to a return.
    #[error("{function}: no path leads to a return")]
    NoReturn {
        /// Which.
        function: String,
    },
    /// The stack pointer is moved by an amount that the code does not say.
    #[error("{function} at {address:#x}: `{text}` moves the stack pointer by an unknown amount")]
    StackPointer {
        /// Where.
        function: String,
        /// Address of the instruction.
        address: u32,
        /// The instruction.
        text: String,
    },
}
