//! The painted texels, all of them.

use super::{BaseTexels, ColorStop, Look, LookTable, PaintTargets, paint_into, paint_rects, texel::FLAT};
use crate::{
    CrackPreset,
    growth::CrackGrowth,
    math::Rng,
    pattern::{Moment, PathPoint, SegmentPath, SurfaceFrame},
    raster::{
        CrushedZone, DepthField, DirtyTiles, Profile, Replay, ReplayChanges, TexelRect, stamp_dot, stamp_path,
        stamp_path_with,
    },
};
use glam::{UVec2, Vec2};

fn below(rng: &mut Rng, n: u32) -> u32 {
    rng.next_u32() % n
}

fn field(size: UVec2) -> DepthField {
    DepthField::new(SurfaceFrame::new(size).unwrap())
}

fn noise_bytes(rng: &mut Rng, n: usize) -> Vec<u8> {
    (0..n).map(|_| rng.next_u32() as u8).collect()
}

fn looks() -> [Look; 5] {
    let wild = Look {
        glint: 4.0,
        uneven_glint: 1.0,
        gloss: 4.0,
        grain: 1.0,
        sparkle: 1.0,
        shift: 16.0,
        relief: 1.0,
        curl: 1.0,
        opaque: true,
        ..Look::GROOVE
    };
    let cast = Look { cast: 4.0, shadow: 1.0, glint: 4.0, relief: 0.1, ..Look::GROOVE };
    [Look::GROOVE, Look::FROSTED, Look::TOON, wild, cast]
}

fn table(look: &Look, field: &DepthField) -> LookTable {
    LookTable::new(look, field.frame.texels_per_unit()).unwrap()
}

/// A picture with room for targets of its own.
struct Canvas {
    size: UVec2,
    base: [Vec<u8>; 3],
    tilted: bool,
    deep: bool,
}

impl Canvas {
    fn new(rng: &mut Rng, size: UVec2) -> Self {
        let n = (size.x * size.y) as usize;
        let base = [noise_bytes(rng, 4 * n), noise_bytes(rng, 4 * n), noise_bytes(rng, n)];
        Self { size, base, tilted: below(rng, 2) == 0, deep: below(rng, 2) == 0 }
    }

    fn base(&self) -> BaseTexels<'_> {
        let [diffuse, normal, depth] = &self.base;
        BaseTexels {
            size: self.size,
            diffuse,
            normal: self.tilted.then_some(normal),
            depth: self.deep.then_some(depth),
        }
    }

    /// What an untouched picture looks like.
    fn untouched(&self) -> [Vec<u8>; 3] {
        let [diffuse, normal, depth] = self.base.clone();
        let normal = if self.tilted { normal } else { FLAT.repeat(depth.len()) };
        let depth = if self.deep { depth } else { vec![0; depth.len()] };
        [diffuse, normal, depth]
    }

    fn paint(&self, field: &DepthField, look: &LookTable, rect: TexelRect, origin: UVec2, out: &mut [Vec<u8>; 3]) {
        self.paint_all(field, look, &[rect], origin, out);
    }

    fn paint_all(
        &self,
        field: &DepthField,
        look: &LookTable,
        rects: &[TexelRect],
        origin: UVec2,
        out: &mut [Vec<u8>; 3],
    ) {
        let [diffuse, normal, depth] = out;
        let mut targets = PaintTargets { diffuse: Some(diffuse), normal: Some(normal), depth: Some(depth) };
        paint_rects(self.base(), field, look, rects, origin, &mut targets);
    }
}

/// Returns what has changed.
fn random_stamp(rng: &mut Rng, field: &mut DepthField) -> Vec<TexelRect> {
    let extent = field.frame.extent();
    let mut place = || Vec2::new(rng.unit(), rng.unit()) * extent;
    let (from, to) = (place(), place());
    let to = from + (to - from).clamp_length_max(0.3);
    let width = 0.06 * rng.unit();
    if below(rng, 5) == 0 {
        return vec![stamp_dot(field, from, width, rng.unit())];
    }
    let profile = Profile { rim_width: 0.02, rim_depth: 0.2, ..Profile::DEFAULT };
    let point = |pos, width| PathPoint { pos, width };
    let path = SegmentPath::straight(point(from, width), point(to, 0.5 * width));
    let mut changed = Vec::new();
    stamp_path_with(field, &profile, &path, &mut |rect| changed.push(rect));
    changed
}

#[test]
fn dirty_painting_equals_full_painting() {
    let mut rng = Rng::new(11);
    let sizes = [[1, 1], [1, 4096], [4096, 1], [3, 5], [31, 37], [64, 64], [65, 127], [130, 66], [211, 17], [2, 300]];
    for (i, size) in sizes.into_iter().enumerate() {
        let mut field = field(size.into());
        let size = UVec2::from(size);
        // Every other time with cast shadows.
        let look = table(&looks()[if i % 2 == 0 { 4 } else { i / 2 % 4 }], &field);
        // The image is the field, or an atlas around it, or cuts the field off.
        let origin = if i % 3 == 0 { UVec2::ZERO } else { UVec2::new(below(&mut rng, 9), below(&mut rng, 9)) };
        let room = if i % 3 == 2 { origin + size - size.min(UVec2::splat(7)) + 1 } else { origin + size + 5 };
        let canvas = Canvas::new(&mut rng, room);
        let mut dirty = DirtyTiles::new(size);
        let mut painted = canvas.untouched();
        let mut rects = Vec::new();
        for step in 0..100 {
            if below(&mut rng, 20) == 0 {
                field.depth.as_mut_slice().fill(0);
                dirty.mark(TexelRect::whole(size));
            }
            for _ in 0..=below(&mut rng, 3) {
                let changed = random_stamp(&mut rng, &mut field);
                changed.iter().for_each(|rect| dirty.mark(look.affected(*rect, &field.depth)));
            }
            rects.clear();
            dirty.take_rects(&mut rects);
            canvas.paint_all(&field, &look, &rects, origin, &mut painted);
            let mut whole = canvas.untouched();
            canvas.paint(&field, &look, TexelRect::whole(size), origin, &mut whole);
            assert!(painted == whole, "size {size}, step {step}");
        }
    }
}

#[test]
fn every_texel_alone_equals_the_whole() {
    let mut rng = Rng::new(12);
    let size = UVec2::new(83, 29);
    let mut field = field(size);
    for _ in 0..12 {
        random_stamp(&mut rng, &mut field);
    }
    for look in looks() {
        let (look, canvas) = (table(&look, &field), Canvas::new(&mut rng, size));
        let (mut whole, mut single) = (canvas.untouched(), canvas.untouched());
        canvas.paint(&field, &look, TexelRect::whole(size), UVec2::ZERO, &mut whole);
        for y in 0..size.y {
            for x in 0..size.x {
                let min = UVec2::new(x, y);
                canvas.paint(&field, &look, TexelRect { min, max: min + 1 }, UVec2::ZERO, &mut single);
            }
        }
        assert!(whole == single, "{look:?}");
    }
}

#[test]
fn untouched_texels_are_the_base_and_the_silhouette_stays() {
    let mut rng = Rng::new(13);
    for look in looks() {
        let size = UVec2::new(150, 90);
        let mut field = field(size);
        for _ in 0..4 {
            random_stamp(&mut rng, &mut field);
        }
        let mut canvas = Canvas::new(&mut rng, size);
        canvas.base[0].as_chunks_mut::<4>().0.iter_mut().step_by(3).for_each(|texel| texel[3] = 0);
        let untouched = canvas.untouched();
        let mut out = untouched.clone();
        canvas.paint(&field, &table(&look, &field), TexelRect::whole(size), UVec2::ZERO, &mut out);
        for y in 0..size.y {
            for x in 0..size.x {
                let at = (y * size.x + x) as usize;
                let rgba = |bytes: &Vec<u8>| bytes.as_chunks::<4>().0[at];
                let (before, after) = (rgba(&untouched[0]), rgba(&out[0]));
                let near = TexelRect { min: UVec2::new(x, y), max: UVec2::new(x + 1, y + 1) }.grow(1, size);
                let touched = (near.min.y..near.max.y)
                    .any(|y| (near.min.x..near.max.x).any(|x| field.depth.get(x, y) != Some(0)));
                if !touched {
                    assert_eq!((before, rgba(&untouched[1])), (after, rgba(&out[1])));
                }
                if field.depth.get(x, y) == Some(0) {
                    assert_eq!(out[2][at], untouched[2][at]);
                }
                assert!(out[2][at] >= untouched[2][at], "depth only sinks");
                assert_eq!(before[3] == 0, after[3] == 0, "silhouette at {x} {y}");
                assert!(after[3] == before[3] || look.opaque && after[3] > before[3], "alpha at {x} {y}");
                if canvas.tilted {
                    assert_eq!(rgba(&untouched[1])[3], rgba(&out[1])[3], "alpha of the normal");
                }
            }
        }
    }
}

#[test]
fn an_opaque_crack_covers_glass() {
    let mut field = field(UVec2::splat(8));
    field.depth.as_mut_slice().fill(65535);
    let black = [ColorStop { depth: 1.0, color: [0.0; 3], cover: 1.0 }];
    let look = Look { ramp: black.to_vec().into(), grain: 0.0, sparkle: 0.0, ..Look::FROSTED };
    let canvas = Canvas {
        size: UVec2::splat(8),
        base: [[200, 100, 50, 60].repeat(64), vec![], vec![]],
        tilted: false,
        deep: false,
    };
    let mut out = vec![0; 256];
    let mut targets = PaintTargets { diffuse: Some(&mut out), normal: None, depth: None };
    paint_into(canvas.base(), &field, &table(&look, &field), TexelRect::whole(canvas.size), UVec2::ZERO, &mut targets);
    assert_eq!(out, [0, 0, 0, 255].repeat(64));
}

#[test]
fn normals_equal_a_sobel_in_f64() {
    let mut rng = Rng::new(14);
    for (round, relief) in [0.0, 0.001, 0.02, 0.3, 1.0].into_iter().enumerate() {
        let size = UVec2::new(70, 41);
        let mut field = field(size);
        if round % 2 == 0 {
            field.depth.as_mut_slice().fill_with(|| rng.next_u32() as u16);
        } else {
            (0..10).for_each(|_| _ = random_stamp(&mut rng, &mut field));
        }
        let canvas = Canvas { tilted: false, ..Canvas::new(&mut rng, size) };
        let mut out = canvas.untouched();
        let look = table(&Look { relief, ..Look::GROOVE }, &field);
        canvas.paint(&field, &look, TexelRect::whole(size), UVec2::ZERO, &mut out);
        let height = |x: i32, y: i32| {
            let inside = |v: i32, n: u32| v.clamp(0, n as i32 - 1) as u32;
            let depth = field.depth.get(inside(x, size.x), inside(y, size.y)).unwrap();
            -f64::from(depth) / 65535.0 * f64::from(relief) * f64::from(field.frame.texels_per_unit())
        };
        for (i, got) in out[1].as_chunks::<4>().0.iter().enumerate() {
            let (x, y) = ((i as u32 % size.x) as i32, (i as u32 / size.x) as i32);
            let across = |k: i32| height(x + 1, y + k) - height(x - 1, y + k);
            let down = |k: i32| height(x + k, y + 1) - height(x + k, y - 1);
            let u = (across(-1) + 2.0 * across(0) + across(1)) / 8.0;
            let v = (down(-1) + 2.0 * down(0) + down(1)) / 8.0;
            let len = (u * u + v * v + 1.0).sqrt();
            for (byte, want) in got.iter().zip([-u / len, v / len, 1.0 / len]) {
                let got = f64::from(*byte) / 255.0 * 2.0 - 1.0;
                assert!((got - want).abs() <= 1.0 / 127.0, "{x} {y}: {got} {want}");
            }
        }
    }
}

#[test]
fn green_is_up_and_light_comes_from_the_upper_left() {
    // A ditch from left to right: its upper wall goes down the picture, so it leans down; the lower one leans up.
    let mut field = field(UVec2::splat(9));
    field.depth.row_mut(4).fill(65535);
    let grey = [128, 128, 128, 255].repeat(81);
    let (mut diffuse, mut normal) = (grey.clone(), grey.clone());
    let look = Look { ramp: vec![].into(), relief: 0.02, ..Look::GROOVE };
    let mut targets = PaintTargets { diffuse: Some(&mut diffuse), normal: Some(&mut normal), depth: None };
    let base = BaseTexels { size: UVec2::splat(9), diffuse: &grey, normal: None, depth: None };
    paint_into(base, &field, &table(&look, &field), TexelRect::whole(base.size), UVec2::ZERO, &mut targets);
    let texel = |bytes: &[u8], y: usize| bytes.as_chunks::<4>().0[y * 9 + 4];
    assert!(texel(&normal, 3)[1] < 120 && texel(&normal, 5)[1] > 136, "{normal:?}");
    assert!(texel(&diffuse, 3)[0] < 128 && texel(&diffuse, 5)[0] > 128, "{diffuse:?}");
    assert_eq!(texel(&normal, 4), FLAT);
}

#[test]
fn a_slow_ramp_has_no_steps() {
    let size = UVec2::new(4096, 1);
    let mut field = field(size);
    for (x, depth) in field.depth.as_mut_slice().iter_mut().enumerate() {
        *depth = 30_000 + x as u16;
    }
    let ramp =
        [ColorStop { depth: 0.0, color: [0.0; 3], cover: 1.0 }, ColorStop { depth: 1.0, color: [1.0; 3], cover: 1.0 }];
    let look = Look { ramp: ramp.to_vec().into(), tint: 0.0, glint: 0.0, grain: 0.0, ..Look::GROOVE };
    let base = [7, 7, 7, 255].repeat(4096);
    let mut out = base.clone();
    let mut targets = PaintTargets { diffuse: Some(&mut out), normal: None, depth: None };
    let texels = BaseTexels { size, diffuse: &base, normal: None, depth: None };
    paint_into(texels, &field, &table(&look, &field), TexelRect::whole(size), UVec2::ZERO, &mut targets);
    for (x, texel) in out.as_chunks::<4>().0.iter().enumerate() {
        let want = f64::from(30_000 + x as u32) / 65536.0 * 255.0;
        assert!((f64::from(texel[0]) - want).abs() <= 0.51, "{x}: {texel:?} {want}");
    }
}

/// Uneven light is between none and all of it on walls that face it, and comes and goes along a groove; walls that face away are as before.
#[test]
fn uneven_light_comes_and_goes_along_a_groove() {
    let size = UVec2::new(512, 64);
    let mut field = field(size);
    for (i, depth) in field.depth.as_mut_slice().iter_mut().enumerate() {
        let away = (i as u32 / size.x).abs_diff(32);
        *depth = 8000 * 6u32.saturating_sub(away) as u16;
    }
    let base = [120, 120, 120, 255].repeat(size.element_product() as usize);
    let paint = |glint: f32, uneven_glint: f32| {
        let mut out = base.clone();
        let mut targets = PaintTargets { diffuse: Some(&mut out), normal: None, depth: None };
        let texels = BaseTexels { size, diffuse: &base, normal: None, depth: None };
        let look = Look { glint, uneven_glint, grain: 0.0, ..Look::GROOVE };
        paint_into(texels, &field, &table(&look, &field), TexelRect::whole(size), UVec2::ZERO, &mut targets);
        out.as_chunks::<4>().0.iter().map(|texel| texel[0]).collect::<Vec<u8>>()
    };
    let [none, even, uneven] = [(0.0, 0.0), (0.9, 0.0), (0.9, 1.0)].map(|(glint, gaps)| paint(glint, gaps));
    let (mut lit, mut dark, mut bright) = (0, 0, 0);
    for ((none, even), uneven) in none.into_iter().zip(even).zip(uneven) {
        if even <= none {
            assert_eq!(uneven, even, "a wall that faces away");
            continue;
        }
        assert!((none..=even).contains(&uneven), "{none} {uneven} {even}");
        lit += 1;
        dark += u32::from(uneven - none <= (even - none) / 8);
        bright += u32::from(even - uneven <= (even - none) / 8);
    }
    assert!(
        lit > 2000 && dark * 10 > lit && bright * 10 > lit,
        "of {lit} lit texels {dark} are dark and {bright} bright"
    );
}

#[test]
fn wrong_slices_and_places_are_left_alone() {
    let mut field = field(UVec2::splat(20));
    field.depth.as_mut_slice().fill(40_000);
    let look = table(&Look::FROSTED, &field);
    let size = UVec2::splat(20);
    let (full, short) = (vec![9; 1600], vec![9; 1599]);
    let whole = TexelRect::whole(size);
    let try_it = |size: UVec2, diffuse: &[u8], normal: &[u8], rect: TexelRect, origin: UVec2, n: usize| {
        let mut out = [vec![9; n], vec![9; n], vec![9; n.div_ceil(4)]];
        let [d, m, e] = &mut out;
        let mut targets = PaintTargets { diffuse: Some(d), normal: Some(m), depth: Some(e) };
        let base = BaseTexels { size, diffuse, normal: Some(normal), depth: None };
        paint_into(base, &field, &look, rect, origin, &mut targets);
        out.map(|out| out.iter().any(|&byte| byte != 9))
    };
    assert_eq!(
        try_it(size, &full, &full, whole, UVec2::ZERO, 1600),
        [true, false, true],
        "an even field has no slopes"
    );
    assert_eq!(try_it(size, &short, &full, whole, UVec2::ZERO, 1600), [false, false, true]);
    assert_eq!(try_it(size, &full, &short, whole, UVec2::ZERO, 1596), [false; 3]);
    assert_eq!(try_it(size, &[], &[], whole, UVec2::ZERO, 0), [false; 3]);
    assert_eq!(try_it(UVec2::MAX, &full, &full, whole, UVec2::ZERO, 1600), [false; 3]);
    assert_eq!(try_it(size, &full, &full, whole, UVec2::splat(20), 1600), [false; 3]);
    assert_eq!(try_it(size, &full, &full, whole, UVec2::MAX, 1600), [false; 3]);
    assert_eq!(
        try_it(size, &full, &full, TexelRect { min: UVec2::MAX, max: UVec2::MAX }, UVec2::ZERO, 1600),
        [false; 3]
    );
    let from_corner = TexelRect { min: UVec2::ZERO, max: UVec2::MAX };
    assert!(try_it(size, &full, &full, from_corner, UVec2::splat(19), 1600)[0], "one texel lies inside");
}

/// A preset whose growth has ended after some hits, the last ones on the first.
fn grown(preset: &CrackPreset, frame: SurfaceFrame, rng: &mut Rng) -> CrackGrowth {
    let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), u64::from(rng.next_u32())).unwrap();
    for round in 0..4 {
        let pos = if round == 2 { Vec2::splat(0.4) } else { Vec2::new(rng.unit(), rng.unit()) } * frame.extent();
        growth.hit(pos, 0.5 + 3.0 * rng.unit());
        growth.hit(pos, 1.0);
        for _ in 0..10 + below(rng, 30) {
            growth.step();
        }
    }
    while growth.step().grew() {}
    growth
}

/// The field of a moment, drawn from nothing.
fn drawn(preset: &CrackPreset, growth: &CrackGrowth, frame: SurfaceFrame, moment: Moment) -> DepthField {
    let mut field = DepthField::new(frame);
    field.set_layers(preset.look.layer(5));
    let (network, timeline) = (growth.network(), growth.timeline());
    for path in network.segments().filter_map(|segment| timeline.path_at(network, segment, moment)) {
        stamp_path(&mut field, &preset.profile, &path);
    }
    field.show_layers(network, timeline, moment, &mut Vec::new());
    field
}

#[test]
fn the_depth_map_has_craters() {
    let frame = SurfaceFrame::new(UVec2::splat(256)).unwrap();
    let mut growth = CrackGrowth::new(CrackPreset::CONCRETE.growth, frame.extent(), 3).unwrap();
    growth.hit(Vec2::splat(0.5), 1.0);
    let moment = Moment::after(growth.timeline().end());
    let field = drawn(&CrackPreset::CONCRETE, &growth, frame, moment);
    let n = 256 * 256;
    let paint = |look: &Look| {
        let mut depth = vec![0; n];
        let base = BaseTexels { size: frame.size(), diffuse: &[], normal: None, depth: None };
        let mut targets = PaintTargets { diffuse: None, normal: None, depth: Some(&mut depth) };
        paint_into(base, &field, &table(look, &field), TexelRect::whole(frame.size()), UVec2::ZERO, &mut targets);
        depth
    };
    let depth = paint(&Look::CONCRETE);
    let cracks: Vec<u8> = field.depth.as_slice().iter().map(|&depth| (u32::from(depth) * 255 / 65535) as u8).collect();
    assert!(depth.iter().zip(&cracks).all(|(all, crack)| all >= crack), "the deeper of both");
    let deeper = depth.iter().zip(&cracks).filter(|(all, crack)| **all > crack.saturating_add(20)).count();
    // A circle of the radius has 363 texels.
    assert!((100..900).contains(&deeper), "{deeper} texels of crater");
}

#[test]
fn presets_painted_where_they_change_equal_the_whole_at_any_time() {
    let mut rng = Rng::new(21);
    let (mut plates, mut spots, mut veils) = (0, 0, 0);
    for name in CrackPreset::NAMES {
        let preset = CrackPreset::named(name).unwrap();
        let size = UVec2::new(150, 110);
        let frame = SurfaceFrame::new(size).unwrap();
        let growth = grown(&preset, frame, &mut rng);
        let (network, timeline) = (growth.network(), growth.timeline());
        let canvas = Canvas::new(&mut rng, size);
        let mut field = DepthField::new(frame);
        field.set_layers(preset.look.layer(5));
        let (mut replay, mut redrawn) = (Replay::new(size, preset.profile), ReplayChanges::default());
        let (mut dirty, mut rects, mut painted) = (DirtyTiles::new(size), Vec::new(), canvas.untouched());
        let end = f64::from(timeline.end());
        let mut moment = Moment::START;
        for step in 0..40 {
            // Onwards in small steps, jumps to and fro, and all the way back.
            moment = match step {
                39 => Moment::START,
                38 => Moment::after(timeline.end()),
                _ if step % 5 == 4 => Moment::nearest(end * f64::from(rng.unit())),
                _ => Moment::nearest(moment.steps() + end * 0.04 * f64::from(rng.unit())),
            };
            replay.show(&mut field, network, timeline, moment, &mut redrawn);
            let look = table(&preset.look, &field);
            redrawn.changed.iter().for_each(|rect| dirty.mark(look.affected(*rect, &field.depth)));
            rects.clear();
            dirty.take_rects(&mut rects);
            canvas.paint_all(&field, &look, &rects, UVec2::ZERO, &mut painted);
            if step % 3 == 0 || step > 36 {
                let anew = drawn(&preset, &growth, frame, moment);
                assert!(field == anew, "{name}: the field at {moment:?}, step {step}");
                let mut whole = canvas.untouched();
                canvas.paint(&anew, &look, TexelRect::whole(size), UVec2::ZERO, &mut whole);
                assert!(painted == whole, "{name}: the picture at {moment:?}, step {step}");
            }
            plates += usize::from(field.layer().plates().is_some());
            spots += usize::from(field.layer().crushed().is_some());
            veils += usize::from(field.layer().veil().is_some_and(|veil| veil.as_slice().iter().any(|&v| v > 0)));
        }
        assert!(painted == canvas.untouched(), "{name}: something is left at the start");
    }
    assert!(plates > 100 && spots > 200 && veils > 20, "too little is shown: {plates} {spots} {veils}");
}

#[test]
fn presets_that_grow_painted_where_they_change_equal_the_whole() {
    let mut rng = Rng::new(22);
    for name in CrackPreset::NAMES {
        let preset = CrackPreset::named(name).unwrap();
        let size = UVec2::new(131, 170);
        let frame = SurfaceFrame::new(size).unwrap();
        let mut growth = CrackGrowth::new(preset.growth.clone(), frame.extent(), 3).unwrap();
        let canvas = Canvas::new(&mut rng, size);
        let mut field = DepthField::new(frame);
        field.set_layers(preset.look.layer(5));
        let look = table(&preset.look, &field);
        let (mut dirty, mut rects, mut painted) = (DirtyTiles::new(size), Vec::new(), canvas.untouched());
        let mut segments = Vec::new();
        for step in 0..60 {
            if step % 15 == 0 {
                growth.hit(Vec2::new(rng.unit(), rng.unit()) * frame.extent(), 0.5 + rng.unit());
            }
            growth.step();
            growth.take_changed(&mut segments);
            for path in segments.drain(..).filter_map(|segment| growth.network().path(segment)) {
                stamp_path_with(&mut field, &preset.profile, &path, &mut |rect| rects.push(rect));
            }
            let timeline = growth.timeline();
            field.show_layers(growth.network(), timeline, Moment::after(timeline.end()), &mut rects);
            rects.drain(..).for_each(|rect| dirty.mark(look.affected(rect, &field.depth)));
            dirty.take_rects(&mut rects);
            canvas.paint_all(&field, &look, &rects, UVec2::ZERO, &mut painted);
            rects.clear();
            if step % 6 == 5 {
                let mut whole = canvas.untouched();
                canvas.paint(&field, &look, TexelRect::whole(size), UVec2::ZERO, &mut whole);
                assert!(painted == whole, "{name}, step {step}");
            }
        }
        let anew = drawn(&preset, &growth, frame, Moment::after(growth.timeline().end()));
        assert!(field.layer() == anew.layer(), "{name}: what has come step by step is not what comes at once");
    }
}

/// On the floor of what has come off no crack is seen where none is to be, and beside it all of it is.
#[test]
fn a_bare_floor_shows_no_crack() {
    let mut rng = Rng::new(23);
    let size = UVec2::splat(160);
    let frame = SurfaceFrame::new(size).unwrap();
    let canvas = Canvas::new(&mut rng, size);
    let paint = |bare: f32, is_cracked: bool| {
        let crushed = CrushedZone {
            broken: true,
            bare,
            radius: 0.2,
            depth: 0.01,
            rough: 0.0,
            chips: 0.0,
            ..CrushedZone::DEFAULT
        };
        let look = Look { crushed: Some(crushed), ..Look::GROOVE };
        let mut field = DepthField::new(frame);
        field.set_layers(look.layer(5));
        let mut growth = CrackGrowth::new(CrackPreset::CONCRETE.growth, frame.extent(), 3).unwrap();
        growth.hit(Vec2::splat(0.5), 1.0);
        growth.step();
        let timeline = growth.timeline();
        field.show_layers(growth.network(), timeline, Moment::after(timeline.end()), &mut Vec::new());
        if is_cracked {
            let point = |x| PathPoint { pos: Vec2::new(x, 0.5), width: 0.02 };
            stamp_path(&mut field, &Profile::DEFAULT, &SegmentPath::straight(point(0.0), point(1.0)));
        }
        let mut out = canvas.untouched();
        canvas.paint(&field, &table(&look, &field), TexelRect::whole(size), UVec2::ZERO, &mut out);
        out
    };
    let texel = |out: &[Vec<u8>; 3], x: usize| [0, 1].map(|map| out[map][4 * (80 * 160 + x)..][..4].to_vec());
    let (plain, cracked, bare) = (paint(1.0, false), paint(0.0, true), paint(1.0, true));
    assert_eq!(texel(&bare, 80), texel(&plain, 80));
    assert_ne!(texel(&cracked, 80), texel(&plain, 80));
    assert_eq!(texel(&bare, 4), texel(&cracked, 4));
}
