//! The physics: acceptance cases with analytic answers, the paper's errata, engine against
//! engine.

mod acceptance;
mod bristles;
mod detector;
mod engines;
mod errata;
mod field_laws;
mod glide;
mod intervals;
mod laws;
mod pid;
mod referee;
mod sampled;
mod single_precision;
mod smooth_speed;
mod systems;
