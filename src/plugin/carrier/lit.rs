//! [`CrackLitMaterial`]: a 2D material that shows normals.

use crate::plugin::api::textures::Maps;
use crate::plugin::api::{CrackSystems, CrackTextures};
use crate::plugin::carrier::slot::{CrackMaterial, MaterialSlot, SideLook};
use bevy::{
    asset::{AssetServer, embedded_asset},
    prelude::*,
    render::{
        RenderApp,
        render_resource::{AsBindGroup, ShaderType},
    },
    shader::ShaderRef,
    sprite_render::{AlphaMode2d, Material2d, Material2dPlugin, SpriteRenderPlugin},
    transform::TransformSystems,
};

/// The most lights that shine on a [`CrackLitMaterial`]; further ones are dark.
pub const MAX_LIGHTS: usize = 4;

/// A picture on a `Mesh2d`, lit by up to [`MAX_LIGHTS`] [`CrackLight2d`].
///
/// ```
/// use bevy::prelude::*;
/// use bevy_crack::{plugin::CrackLitUniform, prelude::*};
///
/// fn setup(
///     mut commands: Commands,
///     assets: Res<AssetServer>,
///     mut meshes: ResMut<Assets<Mesh>>,
///     mut materials: ResMut<Assets<CrackLitMaterial>>,
/// ) {
///     // A wall at night, and a lamp above it.
///     let wall = CrackLitMaterial::new(assets.load("wall.png")).with_ambient(LinearRgba::rgb(0.02, 0.02, 0.05));
///     commands.spawn((
///         Mesh2d(meshes.add(Rectangle::new(400.0, 400.0))),
///         MeshMaterial2d(materials.add(wall)),
///         CrackSurface::new(CrackPreset::CONCRETE),
///     ));
///     commands.spawn((CrackLight2d { range: 300.0, ..default() }, Transform::from_xyz(-80.0, 160.0, 0.0)));
/// }
///
/// let CrackLitUniform { ambient, tint, .. } = CrackLitMaterial::default().with_ambient(LinearRgba::WHITE).lit;
/// assert_eq!((ambient, tint), (Vec4::ONE, Vec4::ONE));
/// # bevy::ecs::system::assert_is_system(setup);
/// ```
#[derive(Asset, AsBindGroup, Reflect, Clone, Debug)]
#[reflect(Default)]
pub struct CrackLitMaterial {
    /// Lights, ambient light and tint. The lights are written by the crate.
    #[uniform(0)]
    pub lit: CrackLitUniform,
    /// The picture; `None` (default) = white.
    #[texture(1)]
    #[sampler(2)]
    pub diffuse: Option<Handle<Image>>,
    /// Tangent-space normals, +Y up, linear; `None` (default) = even.
    #[texture(3)]
    #[sampler(4)]
    pub normal: Option<Handle<Image>>,
}

impl CrackLitMaterial {
    /// A lit picture with a little ambient light.
    #[must_use]
    pub fn new(diffuse: Handle<Image>) -> Self {
        Self { diffuse: Some(diffuse), ..Self::default() }
    }

    /// The same with another ambient light.
    #[must_use]
    pub fn with_ambient(mut self, ambient: LinearRgba) -> Self {
        self.lit.ambient = ambient.to_vec4();
        self
    }
}

impl Default for CrackLitMaterial {
    fn default() -> Self {
        let lit = CrackLitUniform { ambient: Vec4::splat(0.2), tint: Vec4::ONE, ..CrackLitUniform::default() };
        Self { lit, diffuse: None, normal: None }
    }
}

/// The numbers of a [`CrackLitMaterial`].
#[derive(ShaderType, Reflect, Clone, Copy, Debug, Default, PartialEq)]
pub struct CrackLitUniform {
    /// World positions of the lights; w = range, 0 = no light.
    pub position: [Vec4; MAX_LIGHTS],
    /// Colours of the lights, linear, times intensity.
    pub color: [Vec4; MAX_LIGHTS],
    /// Light that is everywhere, linear; 0.2 in a new material.
    pub ambient: Vec4,
    /// Colour that the picture is multiplied with, linear; white in a new material.
    pub tint: Vec4,
}

impl Material2d for CrackLitMaterial {
    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_crack/plugin/carrier/lit.wgsl".into()
    }

    fn alpha_mode(&self) -> AlphaMode2d {
        AlphaMode2d::Blend
    }
}

impl CrackMaterial for CrackLitMaterial {
    const MAPS: Maps = Maps { diffuse: true, normal: true, depth: false, emissive: false, mips: true };

    fn pictures(&self) -> [Option<Handle<Image>>; 3] {
        [self.diffuse.clone(), self.normal.clone(), None]
    }

    fn show(&mut self, textures: &CrackTextures, _relief: f32) {
        if let Some(diffuse) = &textures.diffuse {
            self.diffuse = Some(diffuse.clone());
        }
        if let Some(normal) = &textures.normal {
            self.normal = Some(normal.clone());
        }
    }

    /// It blends anyway.
    fn open(&mut self) {}

    fn close(&mut self, _original: &Self) {}

    fn for_shards(&mut self, picture: &Handle<Image>, opacity: f32) {
        self.diffuse = Some(picture.clone());
        self.lit.tint.w *= opacity;
    }

    fn for_sides(&self, _look: &SideLook, _grain: Option<Handle<Image>>) -> Option<Self> {
        None
    }

    /// One for all.
    fn pipeline_key(&self) -> u64 {
        0
    }
}

impl MaterialSlot for MeshMaterial2d<CrackLitMaterial> {
    type Material = CrackLitMaterial;
    type Mesh = Mesh2d;

    fn material(&self) -> &Handle<CrackLitMaterial> {
        &self.0
    }

    fn set_material(&mut self, material: Handle<CrackLitMaterial>) {
        self.0 = material;
    }
}

/// A light that shines on all [`CrackLitMaterial`]s, from where its entity is. One of whose numbers is not finite is dark.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default)]
#[require(Transform)]
pub struct CrackLight2d {
    /// Colour; default white.
    pub color: Color,
    /// Brightness right below it; 1 shows the picture as it is. 0 or more; default 1.5.
    pub intensity: f32,
    /// How far it reaches, world units, 0 or more; default 600.
    pub range: f32,
    /// How far it is in front of the entity, world units; default 80. Low light shows cracks best.
    pub height: f32,
}

impl Default for CrackLight2d {
    fn default() -> Self {
        Self { color: Color::WHITE, intensity: 1.5, range: 600.0, height: 80.0 }
    }
}

/// Adds the material, where there are assets. In `finish`, so that it does not matter which plugin came first.
pub(crate) fn add_material(app: &mut App) {
    app.register_type::<CrackLight2d>().register_type::<CrackLitMaterial>();
    if !app.world().contains_resource::<AssetServer>() {
        return;
    }
    // A renderer without the 2D one cannot draw it, but surfaces with it crack all the same.
    if app.get_sub_app(RenderApp).is_some() && !app.is_plugin_added::<SpriteRenderPlugin>() {
        app.init_asset::<CrackLitMaterial>();
        return;
    }
    embedded_asset!(app, "lit.wgsl");
    app.add_plugins(Material2dPlugin::<CrackLitMaterial>::default())
        .add_systems(PostUpdate, shine.after(TransformSystems::Propagate).before(CrackSystems::Hit));
}

/// Writes the lights into the materials, when a light has changed or a material is new.
fn shine(
    lights: Query<(&CrackLight2d, &GlobalTransform, Option<&Name>)>,
    changed: Query<(), (With<CrackLight2d>, Or<(Changed<CrackLight2d>, Changed<GlobalTransform>)>)>,
    mut removed: RemovedComponents<CrackLight2d>,
    mut added: MessageReader<AssetEvent<CrackLitMaterial>>,
    mut materials: ResMut<Assets<CrackLitMaterial>>,
    mut has_warned: Local<bool>,
) {
    let is_new = added.read().filter(|event| matches!(event, AssetEvent::Added { .. })).count() > 0;
    if changed.is_empty() && removed.read().count() == 0 && !is_new {
        return;
    }
    let (mut position, mut color) = ([Vec4::ZERO; MAX_LIGHTS], [Vec4::ZERO; MAX_LIGHTS]);
    for (i, (light, transform, called)) in lights.iter().take(MAX_LIGHTS).enumerate() {
        let at = (transform.translation() + Vec3::Z * light.height).extend(light.range.max(0.0));
        let shine = light.color.to_linear().to_vec4() * light.intensity;
        if at.is_finite() && shine.is_finite() && light.range.is_finite() {
            (position[i], color[i]) = (at, shine);
        } else if !core::mem::replace(&mut *has_warned, true) {
            let light =
                called.map_or_else(|| "a `CrackLight2d`".to_owned(), |name| format!("the `CrackLight2d` of {name}"));
            warn!("{light} is dark: its colour, intensity, range, height or place is not finite (this is said once)");
        }
    }
    let is_stale = |material: &CrackLitMaterial| material.lit.position != position || material.lit.color != color;
    let stale: Vec<_> = materials.iter().filter(|(_, material)| is_stale(material)).map(|(id, _)| id).collect();
    for id in stale {
        if let Some(mut material) = materials.get_mut(id) {
            (material.lit.position, material.lit.color) = (position, color);
        }
    }
}
