//! Salts of the random draws of a growth, combined with the seed. Where two are the same number, their other inputs
//! differ.
//!
//! These numbers are frozen: a seed must give the same result in every version.

/// The reach of a hit by direction.
pub(super) const UNEVEN_REACH: u64 = 0xA4;

/// The loaded area of a hit by direction.
pub(super) const UNEVEN_LOAD: u64 = 0xA3;

/// The direction and phase of a wave in which the size of domains varies.
pub(super) const PATCH_WAY: u64 = 0xA6;
pub(super) const PATCH_PHASE: u64 = 0xA7;

/// The rotation of the axes along which a domain is measured, and the deviation of the crack across it.
pub(super) const DOMAIN_AXES: u64 = 0xA1;
pub(super) const DOMAIN_STRAY: u64 = 0xA2;

/// Whether a crack begins with three arms; by node, where [`UNEVEN_REACH`] is by wave.
pub(super) const STAR: u64 = 0xA4;

/// The deviation of a crack from node to node, and from grain to grain.
pub(super) const STRAY: u64 = 0x57A6;
pub(super) const GRAIN: u64 = 0x6A41;

/// Whether a tip stops short of other cracks.
pub(super) const OPEN_END: u64 = 0x15;

/// Whether a place of a ring is left out.
pub(super) const CONNECTION_GAP: u64 = 0xC0;

/// The radial offset of a ring at a ray; mixed before it is used, unlike [`CONNECTION_GAP`].
pub(super) const CORNER: u64 = 0xC0;

/// The deviation of a line from ray to ray.
pub(super) const CHORD: u64 = 0xC1;

/// The position of courses of bricks, and their irregularity.
pub(super) const WALL: u64 = 0xB0;
pub(super) const BRICK: u64 = 0xB1;

/// The preference of a crack for a bed joint, and for a head joint.
pub(super) const LEVEL_JOINT: u64 = 0xB2;
pub(super) const HEAD_JOINT: u64 = 0xB3;

/// Whether a hairline splits a brick, and which one.
pub(super) const SPLIT: u64 = 0xB4;
pub(super) const SPLIT_SIDE: u64 = 0xB5;

/// The relative width of a crack, and the variation of its width.
pub(super) const MIXED_WIDTH: u64 = 0xA5;
pub(super) const UNEVEN_WIDTH: u64 = 0x1D;

/// The strands of a hit.
pub(super) const STRANDS: u64 = 0x57D5;

/// Where cracks start by nucleation.
pub(super) const NUCLEATION: u64 = 0x0C;

/// Whether a tip forks, at which angle, and to which side.
pub(super) const FORK: u64 = 0xF0;
pub(super) const FORK_ANGLE: u64 = 0xF02E;
pub(super) const FORK_SIDE: u64 = 0xF05;
