//! What a task makes of a relief: all that a frame then only hands over.

use crate::Grid;
use crate::pattern::SurfaceFrame;
use crate::plugin::api::{CrackError, CrackRelief};
use crate::plugin::jobs::stepped::{Step, Stepped};
use crate::relief::{Relief, ReliefJob, normals};
#[cfg(feature = "3d")]
use crate::relief::{ReliefFrame, ReliefMesh};
use bevy::{
    asset::RenderAssetUsages,
    image::Image,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};

/// Where a rectangle lies in a mesh's own space.
#[derive(Clone, Copy)]
#[cfg_attr(not(feature = "3d"), expect(dead_code, reason = "only 3D meshes stand out"))]
pub(super) struct Rectangle {
    pub(super) center: Vec3,
    pub(super) size: Vec2,
    /// Whether it faces along y, not along z.
    pub(super) is_ground: bool,
}

/// The pictures of a relief, and its mesh if it stands out.
pub(super) struct Made {
    pub(super) diffuse: Image,
    pub(super) normal: Image,
    /// Where the ground is steep, if cracks are to prefer it.
    pub(super) steep: Option<Image>,
    pub(super) mesh: Option<Mesh>,
}

/// The making of a relief for an entity.
pub(super) struct ReliefWork {
    job: ReliefJob,
    wish: CrackRelief,
    /// What stands out.
    rectangle: Option<Rectangle>,
}

impl ReliefWork {
    pub(super) fn new(wish: &CrackRelief, rectangle: Option<Rectangle>) -> Result<Self, CrackError> {
        wish.validate()?;
        let job = ReliefJob::new(wish.settings.clone(), wish.size, wish.seed)?;
        Ok(Self { job, wish: wish.clone(), rectangle })
    }

    fn make(&self, relief: &Relief) -> Made {
        let by = self.wish.displacement;
        let other = (self.rectangle.is_some() && by != 1.0).then(|| scaled(&relief.heights, by));
        let heights = other.as_ref().unwrap_or(&relief.heights);
        // A relief that stands out more, or less, has other slopes.
        let frame = SurfaceFrame::new(self.wish.size).ok().filter(|_| other.is_some());
        let steeper = frame.map(|frame| normals(heights, &frame));
        Made {
            diffuse: image(&relief.diffuse, TextureFormat::Rgba8UnormSrgb),
            normal: image(steeper.as_ref().unwrap_or(&relief.normal), TextureFormat::Rgba8Unorm),
            steep: (self.wish.prefers_steep > 0.0).then(|| steep(relief, self.wish.prefers_steep)),
            mesh: self.rectangle.and_then(|rectangle| mesh(heights, &rectangle, self.wish.detail)),
        }
    }
}

impl Stepped for ReliefWork {
    type Output = Box<Made>;

    fn step(mut self) -> Result<Step<Self>, CrackError> {
        Ok(match self.job.step()? {
            Some(relief) => Step::Done(Box::new(self.make(&relief))),
            None => Step::More(self),
        })
    }

    fn progress(&self) -> f32 {
        self.job.progress()
    }
}

fn image(texels: &Grid<[u8; 4]>, format: TextureFormat) -> Image {
    let size = texels.size();
    let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
    let data = texels.as_slice().as_flattened().to_vec();
    Image::new(extent, TextureDimension::D2, data, format, RenderAssetUsages::default())
}

fn scaled(heights: &Grid<f32>, by: f32) -> Grid<f32> {
    let mut scaled = heights.clone();
    scaled.as_mut_slice().iter_mut().for_each(|height| *height *= by);
    scaled
}

/// Steep ground as a mask, white where it is steepest.
fn steep(relief: &Relief, share: f32) -> Image {
    let steep = relief.steepness();
    let gray = steep.as_slice().iter().map(|&steep| {
        let value = (f32::from(steep) * share) as u8;
        [value, value, value, 255]
    });
    let mask = Grid::from_vec(steep.size(), gray.collect()).unwrap_or_else(|| Grid::new(steep.size(), [0; 4]));
    image(&mask, TextureFormat::Rgba8UnormSrgb)
}

/// A mesh that stands out of a rectangle. Its slopes are in the normal map alone, so its own normals are those of the rectangle.
#[cfg(feature = "3d")]
pub(super) fn mesh(heights: &Grid<f32>, rectangle: &Rectangle, detail: u32) -> Option<Mesh> {
    use bevy::mesh::{Indices, PrimitiveTopology};

    let frame = ReliefFrame::new(rectangle.size.max(Vec2::splat(1e-6)));
    let made = ReliefMesh::new(heights, &frame, detail).ok()?;
    let count = made.positions.len();
    let turn = if rectangle.is_ground { Quat::from_rotation_x(-core::f32::consts::FRAC_PI_2) } else { Quat::IDENTITY };
    let mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, made.positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 0.0, 1.0]; count])
        .with_inserted_attribute(Mesh::ATTRIBUTE_TANGENT, vec![[1.0, 0.0, 0.0, 1.0]; count])
        .with_inserted_attribute(Mesh::ATTRIBUTE_UV_0, made.uvs)
        .with_inserted_indices(Indices::U32(made.indices))
        .transformed_by(Transform::from_rotation(turn).with_translation(rectangle.center));
    Some(mesh)
}

#[cfg(not(feature = "3d"))]
fn mesh(_: &Grid<f32>, _: &Rectangle, _: u32) -> Option<Mesh> {
    None
}

#[cfg(all(test, feature = "3d"))]
mod tests {
    use super::*;
    use bevy::mesh::VertexAttributeValues;

    /// The tangents are those that the engine makes of such a mesh where it is flat.
    #[test]
    fn tangents_are_those_of_the_engine() {
        let heights = Grid::new(UVec2::splat(9), 0.0);
        for is_ground in [false, true] {
            let rectangle = Rectangle { center: Vec3::new(1.0, 2.0, 3.0), size: Vec2::new(3.0, 2.0), is_ground };
            let made = mesh(&heights, &rectangle, 1).expect("a mesh");
            let engine = made.clone().with_generated_tangents().expect("it has all that it takes");
            let tangents = |mesh: &Mesh| match mesh.attribute(Mesh::ATTRIBUTE_TANGENT) {
                Some(VertexAttributeValues::Float32x4(tangents)) => tangents.clone(),
                _ => Vec::new(),
            };
            let (ours, theirs) = (tangents(&made), tangents(&engine));
            assert_eq!((ours.len(), theirs.len()), (25, 25));
            for (a, b) in ours.iter().zip(&theirs) {
                assert!(Vec4::from(*a).distance(Vec4::from(*b)) < 1e-5, "{a:?} {b:?}");
            }
        }
    }
}
