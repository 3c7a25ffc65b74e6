//! The board as controller: it closes the loop, and a host watches: `clutch loop --board`.
#![no_std]
#![no_main]

use clutch_nucleo_g474re::board::READ_BACK;

clutch_nucleo_g474re::controller!(READ_BACK);
