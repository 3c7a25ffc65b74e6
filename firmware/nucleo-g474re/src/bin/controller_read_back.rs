//! As nucleo-controller, on a rig where the brake's voltage is read back, whatever `READ_BACK` of the board says.
#![no_std]
#![no_main]

clutch_nucleo_g474re::controller!(true);
