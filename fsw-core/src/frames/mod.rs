//! Typed frames and rotations: a vector knows its axes, a rotation knows from which axes to which it maps.
//!
//! Axes: [`Inertial`] planet-centred, equal to the planet-fixed axes at t = 0; [`PlanetFixed`] turns with the planet,
//! z the spin axis, x at longitude 0; [`LocalNed`] north, east, down at the vehicle; [`Body`] x out of the nose,
//! z down at zero bank, y to the right.

mod rotation;
mod spherical;
mod vector;

pub use rotation::Rot;
pub use spherical::{
    PlanetRelative, along_and_across_rad, bank_from_attitude, great_circle_rad, inertial_from_planet_relative,
    initial_azimuth_rad, ned_from_planet_fixed, planet_fixed_from_inertial, planet_relative_from_inertial,
    surface_point,
};
pub use vector::Vec3;

/// A set of axes; implemented only by the markers of this module.
pub trait Axes: Copy + core::fmt::Debug + PartialEq {}

/// Planet-centred inertial axes: the planet-fixed axes at the entry epoch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertial;
/// Axes that turn with the planet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanetFixed;
/// North, east, down at the vehicle's position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalNed;
/// Vehicle axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body;

impl Axes for Inertial {}
impl Axes for PlanetFixed {}
impl Axes for LocalNed {}
impl Axes for Body {}
