//! The programs of the board, by role.

/// A program of a role, whose board reads the brake's voltage back or not. Not a function: a task keeps a copy of each
/// argument for every call on the way.
#[macro_export]
macro_rules! program {
    ($role:ty, $read_back:expr, $board:ident => $(let $params:ident = $made:expr;)? $new:expr) => {
        #[embassy_executor::task]
        async fn control($board: $crate::board::Board<{ $read_back }>, line: $crate::board::Line) -> ! {
            $(let $params = $made;)?
            // In a memory cell of its own, for the same reason.
            static ROLE: static_cell::StaticCell<$role> = static_cell::StaticCell::new();
            let role =
                ROLE.init_with(|| $new.unwrap_or_else(|_| $crate::board::stop(clutch_node::ResetCause::Fault)));
            $crate::run::run(role, $board, line).await
        }

        #[cortex_m_rt::entry]
        fn main() -> ! {
            $crate::run::begin(control)
        }
    };
}

/// The host's data acquisition: `clutch loop --port`.
#[macro_export]
macro_rules! daq {
    ($read_back:expr) => {
        $crate::program!(clutch_node::DaqBoard, $read_back, board => clutch_node::DaqBoard::new(&board.params()));
    };
}

/// The controller: it closes the loop, and a host watches: `clutch loop --board`.
#[macro_export]
macro_rules! controller {
    ($read_back:expr) => {
        $crate::program!(clutch_node::OneChip, $read_back, board =>
            let params = clutch_node::BoardControllerParams {
                board: board.board,
                boot: board.boot,
                clock_hz: $crate::board::CLOCK_HZ,
            };
            clutch_node::OneChip::new(params, &board.params())
        );
    };
}
