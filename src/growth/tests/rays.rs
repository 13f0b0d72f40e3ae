//! Rays.
use crate::CrackPreset;
use crate::growth::CrackGrowth;
use glam::Vec2;

#[test]
fn dump() {
    let mut growth = CrackGrowth::new(CrackPreset::GLASS.growth, Vec2::ONE, 3).unwrap();
    growth.hit(Vec2::splat(0.5), 0.5);
    let plan = growth.plan_rays(0, growth.params().reach * 0.5f32.sqrt()).unwrap();
    while growth.step().grew() {}
    for (i, ray) in plan.rays.iter().enumerate() {
        println!("ray {i} {:?} last {}: {:?}", ray.from, ray.last, ray.line);
        for (node, n) in growth.network().nodes().iter().enumerate() {
            if growth.field.ray_of.get(node) == Some(&(i as u32 | 1 << 31)) {
                print!(" ({:.3} {:.3})", n.pos.x, n.pos.y);
            }
        }
        println!();
    }
}
