//! Lines to contours, heights and meshes.

use super::{Input, run};
use crate::{
    Grid,
    pattern::SurfaceFrame,
    relief::{
        ContourJob, HeightParams, Join, MAX_DETAIL, Method, ReliefError, ReliefFrame, ReliefMesh, ReliefParams,
        heights, normals,
        tests::{oracle::assert_contours, rings::least},
    },
};
use glam::{UVec2, Vec2};
use std::f32::consts::TAU;

fn params(input: &mut Input) -> ReliefParams {
    let join = match input.byte() % 4 {
        0 => Join::Miter,
        1 => Join::Bevel,
        2 => Join::Arc { factor: input.mostly(1.0, 16.0, 64) },
        _ => Join::Round,
    };
    let samples = if input.once_in(64) { input.word() } else { 16 << input.below(5) };
    ReliefParams {
        method: input.choose(&Method::ALL),
        join,
        distance: input.mostly(0.02, 0.5, 64),
        displacement: input.mostly(0.0, 1.0, 64),
        min_angle: input.mostly(0.0, 0.6, 64),
        max_angle: input.mostly(0.6, 1.2, 64),
        samples,
        first_harmonic: 1 + input.below(samples / 2),
        long_edges: input.mostly(0.0, 1.0, 64),
        inward: input.below(8),
        outward: input.below(4),
        steepness: if input.once_in(4) { input.mostly(0.0, 0.8, 64) } else { 0.0 },
        steep_angle: input.mostly(-7.0, 7.0, 64),
    }
}

/// A closed line, crossing itself or not.
fn line(input: &mut Input) -> Vec<Vec2> {
    let middle = Vec2::new(input.unit(), input.unit());
    let radius = input.between(0.05, 0.6);
    let count = input.below(64);
    let kind = input.byte() % 3;
    let mut points: Vec<Vec2> = (0..count)
        .map(|i| match kind {
            0 => middle + radius * input.unit() * crate::math::ops::unit(TAU * i as f32 / count as f32),
            1 => Vec2::new(input.unit(), input.unit()),
            _ => Vec2::new(f32::from(input.byte() % 9), f32::from(input.byte() % 9)) / 8.0,
        })
        .collect();
    if let Some(point) = points.last_mut().filter(|_| input.once_in(48)) {
        point.x = input.odd();
    }
    points
}

fn target(bytes: &[u8]) {
    let input = &mut Input::new(bytes);
    let params = params(input);
    let seed = u64::from(input.word());
    let lines: Vec<Vec<Vec2>> = (0..input.below(4)).map(|_| line(input)).collect();
    let is_varied = input.once_in(6);
    let job = if is_varied {
        let size = UVec2::new(input.below(4), input.below(4));
        let factors: Vec<f32> = (0..size.x * size.y).map(|_| input.mostly(0.1, 8.0, 64)).collect();
        ContourJob::with_factors(&params, &lines, seed, Grid::from_vec(size, factors).unwrap(), Vec2::ONE)
    } else {
        ContourJob::new(&params, &lines, seed)
    };
    let Ok(mut job) = job else { return };
    assert_eq!(params.validate(), Ok(()));
    let mut done = 0.0;
    loop {
        match job.step() {
            Ok(true) => assert!((done..=1.0).contains(&job.progress()), "progress falls: {done}"),
            Ok(false) => break,
            // Lines of so few points never get too long or too tangled.
            Err(error) => panic!("{error}: {params:?}"),
        }
        done = job.progress();
    }
    let contours = job.finish();
    let gap = if is_varied { 0.0 } else { least(&params, 64) * f64::from(params.distance) };
    assert_contours(&contours, gap, &format!("{params:?}"));
    let (lowest, highest) = contours.levels().unwrap();
    assert!(-(params.outward as i32) <= lowest && lowest <= 0 && highest <= params.inward as i32);
    assert!(contours.rings.iter().flat_map(|ring| &ring.points).all(|point| point.is_finite()));

    let shape = HeightParams {
        step: input.mostly(0.0001, 4.0, 64),
        variation: input.mostly(0.0, 0.9, 64),
        taper: input.mostly(0.0, 0.95, 64),
        summit: input.mostly(0.0, 1.0, 64),
        floor: input.mostly(0.0, 64.0, 64),
        terraces: input.mostly(0.0, 1.0, 64),
        tread: input.mostly(0.0, 0.95, 64),
        roundness: input.mostly(0.0, 1.0, 64),
        cliffs: input.mostly(0.0, 1.0, 64),
        roughness: input.mostly(0.0, 1.0, 64),
        noise_scale: input.mostly(0.005, 4.0, 64),
    };
    let frame = SurfaceFrame::new(UVec2::new(1 + input.below(40), 1 + input.below(40))).unwrap();
    let grid = match heights(&contours, &shape, frame, seed) {
        Ok(grid) => grid,
        // Contours that are far apart lead far away.
        Err(ReliefError::Point { x, y, most, .. }) if x.abs().max(y.abs()) > most => return,
        Err(error) => {
            assert!(shape.validate().is_err(), "{error}: {shape:?}");
            return;
        }
    };
    // From the foot to above the summit: no level is more than two steps high.
    let (least, most) = (shape.step * (lowest as f32 * 2.0 - 66.0), shape.step * (highest as f32 * 2.0 + 3.0));
    assert!(grid.as_slice().iter().all(|height| (least..=most).contains(height)), "{least}..={most}: {shape:?}");
    if grid.size().min_element() >= 2 {
        assert_eq!(normals(&grid, &frame).size(), grid.size());
        let mesh = ReliefMesh::new(&grid, &ReliefFrame::new(Vec2::ONE), input.below(1 + MAX_DETAIL)).unwrap();
        assert!(mesh.positions.iter().chain(&mesh.normals).flatten().all(|value| value.is_finite()));
        assert!(mesh.indices.iter().all(|&index| (index as usize) < mesh.positions.len()));
    }
}

#[test]
fn contours() {
    run("contours", 300, target);
}
