//! The programs of the board, by role.

/// A program of a role, whose board reads the brake's voltage back or not. Not a function: a task keeps a copy of each
/// argument for every call on the way.
///
/// The role is made in a memory cell, by a function of its own: what it takes of the stack would be the task's in each period.
#[macro_export]
macro_rules! program {
    ($role:ty, $read_back:expr, $board:ident => $(let $params:ident = $made:expr;)? $new:expr) => {
        #[embassy_executor::task]
        async fn control(board: $crate::board::Board<{ $read_back }>, line: $crate::board::Line) -> ! {
            let role = role(&board);
            $crate::run::run(role, board, line).await
        }

        #[inline(never)]
        fn role($board: &$crate::board::Board<{ $read_back }>) -> &'static mut $role {
            $(let $params = $made;)?
            static ROLE: static_cell::StaticCell<$role> = static_cell::StaticCell::new();
            ROLE.init_with(|| $new)
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
        $crate::program!(clutch_node::DaqBoard, $read_back, board =>
            clutch_node::DaqBoard::new(&board.params())
                .unwrap_or_else(|_| $crate::board::stop(clutch_node::ResetCause::Fault))
        );
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
            // Its parameters were checked when they were compiled.
            clutch_node::OneChip::of(params, &board.params())
        );
    };
}
