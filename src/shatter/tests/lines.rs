//! Edges of shards and the lines that they were cut along: cracks of every preset, and seams of Voronoi maps.

use super::*;
use crate::voronoi::{Seams, SiteLayout, VoronoiBake, VoronoiMap, VoronoiParams};
use glam::UVec2;

/// Half a texel of the largest surface.
const NEAR: f32 = 0.5 / 16_384.0;

/// Pieces of lines, found by place.
struct Lines {
    pieces: Vec<(Vec2, Vec2)>,
    cells: BTreeMap<[i32; 2], Vec<u32>>,
}

impl Lines {
    /// Side of a cell.
    const CELL: f32 = 1.0 / 64.0;

    fn cell(pos: Vec2) -> [i32; 2] {
        (pos / Self::CELL).floor().as_ivec2().to_array()
    }

    fn new(pieces: Vec<(Vec2, Vec2)>) -> Self {
        let mut cells = BTreeMap::<_, Vec<u32>>::new();
        for (i, (a, b)) in (0u32..).zip(&pieces) {
            let [low, high] = [Self::cell(a.min(*b) - NEAR), Self::cell(a.max(*b) + NEAR)];
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    cells.entry([x, y]).or_default().push(i);
                }
            }
        }
        Self { pieces, cells }
    }

    /// All that was drawn: the rough lines of the cracks, and those by which they were extended.
    fn drawn(network: &Network, shards: &Shards) -> Self {
        let paths = network.segments().filter_map(|segment| network.path(segment));
        let mut pieces: Vec<_> = paths
            .flat_map(|path| path.points().windows(2).map(|pair| (pair[0].pos, pair[1].pos)).collect::<Vec<_>>())
            .collect();
        pieces.extend(shards.extended_lines().iter().flat_map(|line| line.windows(2).map(|pair| (pair[0], pair[1]))));
        Self::new(pieces)
    }

    fn has(&self, pos: Vec2) -> bool {
        let near = self.cells.get(&Self::cell(pos)).into_iter().flatten();
        near.map(|&i| self.pieces[i as usize]).any(|(a, b)| shards::distance_to_line(pos, a, b) < NEAR)
    }
}

/// Places along the edges of all shards, outlines and holes, that lie on none of the lines nor on the border; and how many there are.
fn stray(shards: &Shards, lines: &Lines) -> (Vec<Vec2>, usize) {
    let (mut stray, mut count) = (Vec::new(), 0);
    for shard in 0..shards.len() as u32 {
        for [a, b] in shards.rings_of(shard).flat_map(edges) {
            if shards.lattice.side_of(shards.places[a as usize], shards.places[b as usize]).is_some() {
                continue;
            }
            let [a, b] = [a, b].map(|vertex| shards.positions()[vertex as usize]);
            let steps = ((a.distance(b) / NEAR) as u32).clamp(2, 8);
            for step in 0..=steps {
                let pos = a.lerp(b, step as f32 / steps as f32);
                count += 1;
                if !lines.has(pos) {
                    stray.push(pos);
                }
            }
        }
    }
    (stray, count)
}

/// Not the middles of edges alone: places all along them, of every preset.
#[test]
fn edges_lie_on_drawn_lines_all_along() {
    let mut all = 0;
    for name in CrackPreset::NAMES {
        let mut checked = 0;
        for seed in 0..2 {
            let network = grown(&CrackPreset::named(name).unwrap(), 1 + seed as u32 % 3, seed);
            for extend_cracks in [false, true] {
                let params = ShatterParams { extend_cracks, seed, ..ShatterParams::DEFAULT };
                let shards = shatter(Cuts::from_network(&network).unwrap(), &params).unwrap();
                let (stray, count) = stray(&shards, &Lines::drawn(&network, &shards));
                assert!(stray.is_empty(), "{name} {seed}: {} of {count}, at {}", stray.len(), stray[0]);
                checked += count;
            }
        }
        assert!(checked > 100, "{name}: {checked}");
        all += checked;
    }
    println!("{all} places on edges");
}

/// The check can fail: a line that nobody has drawn is found out.
#[test]
fn edges_on_no_line_are_found() {
    let network = grown(&CrackPreset::GLASS, 2, 5);
    let mut cuts = Cuts::from_network(&network).unwrap();
    let alone = shatter(cuts.clone(), &ShatterParams::DEFAULT).unwrap();
    cuts.add_line(&[Vec2::new(0.0, 0.31), Vec2::new(1.5, 0.67)]).unwrap();
    let shards = shatter(cuts, &ShatterParams::DEFAULT).unwrap();
    let lines = Lines::drawn(&network, &alone);
    assert!(stray(&shards, &lines).0.len() > 20);
}

/// A map and its seams, and the shards between them.
fn regions(params: VoronoiParams, size: UVec2, seed: u64) -> (VoronoiMap, Seams, Shards) {
    let (map, seams) = VoronoiBake::new(params, Vec::new(), size, seed).unwrap().finish();
    let mut cuts = Cuts::new(seams.extent).unwrap();
    for seam in &seams.seams {
        cuts.add_line(&seam.points.iter().map(|point| point.pos).collect::<Vec<_>>()).unwrap();
    }
    let shards = shatter(cuts, &EVERYTHING).unwrap();
    (map, seams, shards)
}

/// The region of each shard, by the seams along its edges: all must say the same.
fn region_of_shards(seams: &Seams, shards: &Shards) -> Vec<u32> {
    // The region to the right of each piece of a seam, in both directions.
    let mut right = BTreeMap::new();
    for seam in &seams.seams {
        let places: Vec<_> = seam.points.iter().map(|point| shards.lattice.snap(point.pos)).collect();
        for pair in places.windows(2) {
            right.insert((pair[0], pair[1]), seam.right);
            right.insert((pair[1], pair[0]), seam.left);
        }
    }
    (0..shards.len() as u32)
        .map(|shard| {
            // Outlines turn from x to y, so the inside is to the right.
            let ends =
                shards.rings_of(shard).flat_map(edges).map(|edge| edge.map(|vertex| shards.places[vertex as usize]));
            let inner = ends.filter(|&[a, b]| shards.lattice.side_of(a, b).is_none());
            let found: BTreeSet<u32> = inner.map(|[a, b]| *right.get(&(a, b)).expect("an edge on no seam")).collect();
            assert_eq!(found.len(), 1, "shard {shard} lies in regions {found:?}");
            found.into_iter().next().expect("one")
        })
        .collect()
}

/// Every region is one or more whole shards; shards do not overlap, and their areas add up to those of the regions.
#[test]
fn regions_of_voronoi_maps_are_unions_of_shards() {
    let (mut shards_in_all, mut parted) = (0, 0);
    for seed in 0..12u64 {
        let layout = [SiteLayout::Uniform, SiteLayout::Even, SiteLayout::Impact { at: Vec2::splat(0.4), focus: 3.0 }];
        let params = VoronoiParams {
            sites: 40,
            levels: 1 + seed as u32 % 3,
            layout: layout[seed as usize % 3].clone(),
            ..VoronoiParams::DEFAULT
        };
        let size = UVec2::new(160, 120);
        let (map, seams, shards) = regions(params, size, seed);
        check_tiling(&shards);
        let region = region_of_shards(&seams, &shards);

        let texel = f64::from(map.frame().texels_per_unit().recip());
        let (mut areas, mut lengths) = (BTreeMap::<u32, f64>::new(), BTreeMap::<u32, f64>::new());
        for (shard, &region) in shards.iter().zip(&region) {
            *areas.entry(region).or_default() += f64::from(shard.area);
        }
        for seam in &seams.seams {
            let length: f32 = seam.points.windows(2).map(|pair| pair[0].pos.distance(pair[1].pos)).sum();
            for side in [seam.left, seam.right] {
                *lengths.entry(side).or_default() += f64::from(length);
            }
        }
        let mut texels = BTreeMap::<u32, f64>::new();
        let mut inner = 0;
        for y in 0..size.y {
            for x in 0..size.x {
                let here = map.region(x, y).unwrap();
                *texels.entry(here).or_default() += texel * texel;
                // Away from the seams a texel is in a shard of its region.
                let around =
                    (x.saturating_sub(2)..=x + 2).flat_map(|x| (y.saturating_sub(2)..=y + 2).map(move |y| (x, y)));
                if (x + 7 * y) % 11 == 0 && around.filter_map(|(x, y)| map.region(x, y)).all(|other| other == here) {
                    let shard = shards.at(map.frame().to_pos(Vec2::new(x as f32, y as f32) + 0.5)).unwrap();
                    assert_eq!(region[shard as usize], here, "seed {seed}: texel {x}, {y}");
                    inner += 1;
                }
            }
        }
        assert!(inner > 100, "seed {seed}: {inner}");
        assert!(areas.keys().eq(texels.keys()), "seed {seed}: regions without shards");
        for (region, area) in &areas {
            // Seams are smooth lines along the texels.
            let (expected, most) = (texels[region], 0.7 * texel * lengths[region]);
            assert!((area - expected).abs() < most, "seed {seed}, region {region}: {area}, not {expected}, {most}");
        }
        shards_in_all += shards.len();
        parted += shards.len() - areas.len();
    }
    println!("{shards_in_all} shards, {parted} more than regions");
    assert!(shards_in_all > 300, "{shards_in_all}");
}
