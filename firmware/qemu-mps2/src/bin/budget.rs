//! The cost of a control period, in executed instructions: calls each function that has a budget
//! over an adversarial set of inputs, and prints `name calls least mean most`.
//!
//! Run it with `-icount shift=7,align=off,sleep=off`: the timer then counts instructions.
#![no_std]
#![no_main]

#[path = "../../../shared/panic.rs"]
mod panic;

#[path = "../budget/friction.rs"]
mod friction;
#[path = "../budget/inputs.rs"]
mod inputs;
#[path = "../budget/kernels.rs"]
mod kernels;
#[path = "../budget/laws.rs"]
mod laws;
#[path = "../budget/meter.rs"]
mod meter;
#[cfg(feature = "peer")]
#[path = "../budget/peer.rs"]
mod peer;
#[cfg(feature = "peer")]
#[path = "../budget/peer_servo.rs"]
mod peer_servo;
#[path = "../budget/servos.rs"]
mod servos;
#[path = "../budget/session.rs"]
mod session;

use cortex_m_rt::entry;

#[entry]
fn main() -> ! {
    // Nothing: a parameter that a constructor refuses.
    semihosting::process::exit(if measure().is_some() { 0 } else { 1 })
}

fn measure() -> Option<()> {
    meter::start()?;
    laws::measure()?;
    servos::measure()?;
    friction::measure()?;
    #[cfg(feature = "peer")]
    peer::measure()?;
    #[cfg(feature = "peer")]
    peer_servo::measure()?;
    session::measure()
}
