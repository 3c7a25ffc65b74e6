//! The physics: acceptance cases with analytic answers, the paper's errata, engine against
//! engine.

mod acceptance;
mod auto;
mod bristles;
mod detector;
mod draw;
mod energy;
mod engines;
mod errata;
mod field_laws;
mod glide;
mod intervals;
mod laws;
mod letting_go;
mod linear;
mod one_shaft;
mod parts;
mod pid;
mod referee;
mod sampled;
mod single_precision;
mod slide;
mod smooth_speed;
mod systems;
