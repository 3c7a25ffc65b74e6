//! The obstacles to a bound.

/// The reason why there is no bound, and its place.
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
        /// The function with the jump.
        function: String,
        /// Address of the jump.
        address: u32,
        /// Address to which it jumps.
        target: u32,
    },
    /// Bytes that are not an instruction.
    #[error("{function} at {address:#x}: not an instruction")]
    Undecodable {
        /// The function.
        function: String,
        /// Address of the bytes.
        address: u32,
    },
    /// An address in a trace that is not an instruction of the image.
    #[error("a trace has {address:#x}, which is not an instruction of the image")]
    Untraceable {
        /// The address.
        address: u32,
    },
    /// An instruction without an entry in the table of cycles.
    #[error("{function} at {address:#x}: no cost is known for `{text}`")]
    NoCost {
        /// The function.
        function: String,
        /// Address of the instruction.
        address: u32,
        /// The instruction.
        text: String,
    },
    /// A call or jump through a register, memory or table.
    #[error("{function} at {address:#x}: `{text}` goes to a place that the code does not show")]
    Indirect {
        /// The function.
        function: String,
        /// Address of the instruction.
        address: u32,
        /// The instruction.
        text: String,
    },
    /// A loop without a stated bound.
    #[error("{function} at {address:#x}: a loop without a stated bound; its code comes from: {from}")]
    Unbounded {
        /// The function.
        function: String,
        /// Address of the loop's head.
        address: u32,
        /// The functions that the head was inlined from, innermost first.
        from: String,
    },
    /// A call of memcpy or the like with a length that neither the code nor a fact gives.
    #[error("{function} at {address:#x}: {callee} of an unknown length")]
    Length {
        /// The function.
        function: String,
        /// Address of the call.
        address: u32,
        /// The called function.
        callee: String,
    },
    /// A jump into the middle of a loop.
    #[error("{function} at {address:#x}: a jump into the middle of a loop")]
    Irreducible {
        /// The function.
        function: String,
        /// Address of the block that is jumped to.
        address: u32,
    },
    /// A function that calls itself, by way of others or not.
    #[error("recursion: {0}")]
    Recursion(String),
    /// The code continues past the function's end.
    #[error("{function}: the code runs past the function's end")]
    RunsOff {
        /// The function.
        function: String,
    },
    /// No path leads from the entry to a return.
    #[error("{function}: no path leads to a return")]
    NoReturn {
        /// The function.
        function: String,
    },
    /// The stack pointer is moved by an amount that the code does not show.
    #[error("{function} at {address:#x}: `{text}` moves the stack pointer by an unknown amount")]
    StackPointer {
        /// The function.
        function: String,
        /// Address of the instruction.
        address: u32,
        /// The instruction.
        text: String,
    },
}
