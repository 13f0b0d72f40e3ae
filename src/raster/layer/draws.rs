//! Salts of the random draws of crushed zones, combined with the seed. Where two are the same number, their other
//! inputs differ.
//!
//! These numbers are frozen: a seed must give the same result in every version.

/// Deviation of a crumbling edge: in wide bumps and in fine ones.
pub(super) const JAG_WIDE: u32 = 0x58;
pub(super) const JAG_FINE: u32 = 0x59;

/// Where its wall is a slope, and the deviation of the edge of the basin.
pub(super) const WALL_SLOPE: u32 = 0x5A;
pub(super) const BASIN_EDGE: u32 = 0x5B;

/// Facets of the floor, large and small.
pub(super) const PLATES: u32 = 0x51;
pub(super) const SMALL_PLATES: u32 = 0x54;

/// Tones of a crumbling floor: local ones and a global one.
pub(super) const COARSE_TONE: u32 = 0x56;
pub(super) const BROAD_TONE: u32 = 0x5F;

/// Patches of light on the edge of a crater with ledges, powder on its floor, and heaps of dust around it; the next
/// numbers are those of finer ones.
pub(super) const EDGE_PATCHES: u32 = 0x15A;
pub(super) const POWDER: u32 = 0x25F;
pub(super) const HEAPS: u32 = 0x333;

/// Its sand, and pits in it.
pub(super) const SAND: u32 = 0x57;
pub(super) const SAND_PITS: u32 = 0x65;

/// Its lumps, of two sizes.
pub(super) const LUMPS: u32 = 0x68;

/// Rounded stones in it.
pub(super) const STONES: u32 = 0x5C;

/// Grains of a clean floor, and tones between them.
pub(super) const GRAINS: u32 = 0x52;
pub(super) const GRAIN_TONE: u32 = 0x53;

/// Edges and faces of chips.
pub(super) const CHIP_EDGE: u32 = 0x66;
pub(super) const CHIP_FACE: u32 = 0x67;

/// Crumbs; the next numbers are those of one crumb.
pub(super) const CRUMBS: u32 = 0x80;

/// Clods of loose material; the next numbers are those of one clod.
pub(super) const CLODS: u32 = 0x1C0;

/// Outlines of clods.
pub(super) const CLOD_OUTLINE: u32 = 0x1D0;

/// Sizes and positions of the pieces that break off.
pub(super) const PIECES: u32 = 0x0B0E;

/// Which bricks break off.
pub(super) const FACES: u32 = 0x63;

/// Chipped edges of bricks below the faces that have come off.
pub(super) const CHIPPED: u32 = 0x64;

/// Outlines: of the crater, its basin, a drawn pit, and a hole with its broken edge.
pub(super) const CRATER: u32 = 0x60;
pub(super) const BASIN: u32 = 0x61;
pub(super) const PIT: u32 = 0x62;
pub(super) const HOLE: u32 = 0x71;
pub(super) const SHELL: u32 = 0x72;

/// Scattered places: the vertical position of each, and its own random number.
pub(super) const SITE_DOWN: u32 = 0x77;
pub(super) const SITE_OWN: u32 = 0x7A;

/// Short cracks that cross each other.
pub(super) const SHEETS: u32 = 0x77;

/// Bubbles.
pub(super) const BUBBLES: u32 = 0xB0B;
