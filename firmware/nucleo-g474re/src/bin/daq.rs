//! The board as the host's data acquisition: `clutch loop --port`.
#![no_std]
#![no_main]

use clutch_nucleo_g474re::board::READ_BACK;

clutch_nucleo_g474re::daq!(READ_BACK);
