//! The program of the board as the host's data acquisition.

/// The program, whose board reads the brake's voltage back or not. Not a function: a task keeps a copy of each argument for
/// every call on the way.
#[macro_export]
macro_rules! daq {
    ($read_back:expr) => {
        use clutch_node::{DaqBoard, ResetCause};
        use clutch_nucleo_g474re::board::{Board, Line, stop};
        use clutch_nucleo_g474re::run;
        use static_cell::StaticCell;

        #[embassy_executor::task]
        async fn control(board: Board<{ $read_back }>, line: Line) -> ! {
            // In a memory cell of its own, for the same reason.
            static ROLE: StaticCell<DaqBoard> = StaticCell::new();
            let role =
                ROLE.init_with(|| DaqBoard::new(&board.params()).unwrap_or_else(|_| stop(ResetCause::Fault)));
            run::run(role, board, line).await
        }

        #[cortex_m_rt::entry]
        fn main() -> ! {
            run::begin(control)
        }
    };
}
