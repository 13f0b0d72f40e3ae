//! As many pieces as there may be.

use super::*;

/// Rows and columns of uneven cells, `side` each way.
fn cells(side: u32, seed: u64) -> Cuts {
    let mut rng = Rng::new(seed).stream("cells");
    let mut corners = Vec::new();
    for y in 0..=side {
        for x in 0..=side {
            let on_border = |i: u32| i == 0 || i == side;
            let shift = |i: u32, rng: &mut Rng| if on_border(i) { 0.0 } else { 0.35 * rng.signed() };
            let [dx, dy] = [x, y].map(|i| shift(i, &mut rng));
            corners.push(Vec2::new((x as f32 + dx) / side as f32, (y as f32 + dy) / side as f32));
        }
    }
    let at = |x: u32, y: u32| corners[(y * (side + 1) + x) as usize];
    let mut cuts = Cuts::new(Vec2::ONE).unwrap();
    for i in 1..side {
        cuts.add_line(&(0..=side).map(|x| at(x, i)).collect::<Vec<_>>()).unwrap();
        cuts.add_line(&(0..=side).map(|y| at(i, y)).collect::<Vec<_>>()).unwrap();
    }
    cuts
}

/// Every triangle as it is drawn, in single precision: it has an area, and they add up to the surface.
fn check_triangles(shards: &Shards) {
    let mut sum = 0.0;
    for shard in 0..shards.len() as u32 {
        let corners = shards.corners(shard);
        for triangle in shards.triangles(shard) {
            let [a, b, c] = triangle.map(|i| shards.positions()[corners[i as usize] as usize].as_dvec2());
            let area = 0.5 * (b - a).perp_dot(c - a);
            assert!(area >= 0.5 / (shards.lattice.scale * shards.lattice.scale), "a triangle of {area} in {shard}");
            sum += area;
        }
    }
    let whole = f64::from(shards.extent().x) * f64::from(shards.extent().y);
    assert!((sum / whole - 1.0).abs() < 1e-3, "{sum} of {whole}");
}

fn check_normals(shards: &Shards) {
    let frame = MeshFrame { rim: RimLook::STONE, ..MeshFrame::new(Vec2::ONE) };
    for number in 0..shards.len() as u32 {
        let mesh = shards.solid_mesh(number, &frame, 0.02);
        for normal in &mesh.normals {
            assert!((Vec3::from(*normal).length() - 1.0).abs() < 1e-4, "{normal:?} in {number}");
        }
    }
}

/// 16,900 cells, of which 10,000 are left: the smallest are merged into their neighbours, and nothing is lost.
#[test]
fn b5_no_more_pieces_than_may_be_and_no_area_lost() {
    let shards = shatter(cells(130, 1), &EVERYTHING).unwrap();
    assert_eq!((shards.len(), EVERYTHING.max_shards), (10_000, 10_000));
    check_tiling(&shards);
    check_triangles(&shards);
    check_normals(&shards);
    let sum: f64 = shards.iter().map(|shard| f64::from(shard.area)).sum();
    assert!((sum - 1.0).abs() < 1e-3, "{sum}");
    // The largest of all cells were not merged with anything, the smallest all were.
    let mut all: Vec<f32> = shatter(cells(130, 1), &ShatterParams { max_shards: 1_000_000, ..EVERYTHING })
        .unwrap()
        .iter()
        .map(|shard| shard.area)
        .collect();
    assert_eq!(all.len(), 130 * 130);
    all.sort_by(f32::total_cmp);
    let smallest = shards.iter().map(|shard| shard.area).fold(f32::INFINITY, f32::min);
    assert!(smallest >= all[all.len() - 10_000], "{smallest}: a smaller piece is left than one that was merged");
}

/// 10,000 cells, one for each piece that may be: all are left as they were cut.
#[test]
fn b5_as_many_pieces_as_may_be_stay_whole() {
    let shards = shatter(cells(100, 2), &EVERYTHING).unwrap();
    assert_eq!(shards.len(), 10_000);
    check_tiling(&shards);
    check_triangles(&shards);
    assert!((0..10_000).all(|shard| shards.corners(shard).len() == 4));
}

/// Lines all across each other make splinters of all sizes: with the usual smallest area none is left.
#[test]
fn b5_splinters_are_merged() {
    let mut rng = Rng::new(5).stream("across");
    let mut cuts = Cuts::new(Vec2::ONE).unwrap();
    for _ in 0..180 {
        let ends = [0.0, 1.0].map(|x| Vec2::new(x, rng.unit()));
        cuts.add_line(&if rng.unit() < 0.5 { ends } else { ends.map(|end| Vec2::new(end.y, end.x)) }).unwrap();
    }
    let every = shatter(cuts.clone(), &ShatterParams { max_shards: 1_000_000, ..EVERYTHING }).unwrap();
    assert!(every.len() > 5000, "{}", every.len());
    check_tiling(&every);
    check_triangles(&every);
    let shards = shatter(cuts, &ShatterParams::DEFAULT).unwrap();
    check_tiling(&shards);
    check_triangles(&shards);
    let least = ShatterParams::DEFAULT.min_area;
    assert!(every.iter().any(|shard| shard.area < 0.01 * least), "no splinters to merge");
    assert!(shards.iter().all(|shard| shard.area > 0.999 * least) && shards.len() > 1000, "{}", shards.len());
}

/// A whole surface broken again as finely as it can be: the work is in proportion to the number of pieces.
#[test]
fn b5_a_piece_breaks_into_thousands() {
    let whole = shatter(Cuts::new(Vec2::ONE).unwrap(), &EVERYTHING).unwrap();
    for largest in [1e-2, 1e-3, 1e-6] {
        let pieces = whole.break_again(0, largest, 3).unwrap();
        check_tiling(&pieces);
        check_triangles(&pieces);
        let (count, area) = (pieces.len() as f32, pieces.iter().map(|piece| piece.area).fold(0.0, f32::max));
        // What was cut 12 times stays as large as it is.
        let (least, most) = if largest < 1e-3 { (3000.0, 12_000.0) } else { (1.0 / largest, 4.0 / largest) };
        assert!((least..most).contains(&count) && area <= largest.max(0.01), "{largest}: {count}, {area}");
    }
}
