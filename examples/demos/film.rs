//! Pictures and a GIF of a run without a window.

use crate::{
    machine::{DemoArguments, Output},
    moving,
};
use bevy::{
    camera::RenderTarget,
    prelude::*,
    render::{
        render_resource::TextureFormat,
        view::screenshot::{Screenshot, ScreenshotCaptured},
    },
};
use bevy_crack::prelude::CrackTextures;
use image::{
    RgbaImage,
    imageops::{self, FilterType},
};
use std::{error::Error, fs, path::Path};

/// Width of the drawn pictures.
const WIDTH: u32 = 1280;

/// Frames a second of a scripted run.
pub(crate) const RATE: u32 = 30;

/// How long a picture of the GIF is shown at the most, hundredths of a second: a long run is shown faster than it was.
const LONGEST: u32 = 10;

/// Takes pictures where there is no window, writes them, and ends the app.
pub(crate) struct FilmPlugin;

/// The pictures of a run without a window.
#[derive(Resource, Default)]
pub(crate) struct Film {
    /// Where the camera draws to.
    target: Option<Handle<Image>>,
    frame: u32,
    /// Pictures asked of the renderer that have not come yet.
    awaited: u32,
    strip: Vec<RgbaImage>,
    stills: u32,
}

impl Film {
    /// Frames that are over.
    pub(crate) fn frame(&self) -> u32 {
        self.frame
    }
}

/// The untouched picture of a surface: what is shown of it where nothing can be drawn.
#[derive(Component, Clone, Debug)]
pub struct OnCanvas {
    /// The picture.
    pub picture: Handle<Image>,
    /// Its size in the world.
    pub size: Vec2,
}

impl Plugin for FilmPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Film>()
            .add_systems(PreStartup, open_film)
            .add_observer(aim_camera)
            .add_systems(First, draw_when_due)
            .add_systems(Last, (take_picture, end).chain());
    }
}

fn open_film(
    mut film: ResMut<Film>,
    output: Res<Output>,
    arguments: Res<DemoArguments>,
    mut images: ResMut<Assets<Image>>,
) {
    if *output == Output::Offscreen {
        let target = Image::new_target_texture(WIDTH, arguments.height(), TextureFormat::Rgba8UnormSrgb, None);
        film.target = Some(images.add(target));
    }
}

/// Where there is no window, cameras draw into the film.
fn aim_camera(camera: On<Add, Camera>, film: Res<Film>, mut commands: Commands) {
    if let Some(target) = film.target.clone() {
        commands.entity(camera.entity).insert(RenderTarget::Image(target.into()));
    }
}

impl DemoArguments {
    /// From picture to picture, frames.
    fn step(&self) -> u32 {
        (self.frames / self.pictures.max(1)).max(1)
    }

    /// Height of the drawn pictures.
    fn height(&self) -> u32 {
        self.height.clamp(16, 4096)
    }

    /// Whether a picture is taken of this frame; of the last frame for sure.
    fn is_due(&self, frame: u32) -> bool {
        frame <= self.frames && (frame.is_multiple_of(self.step()) || frame == self.frames)
    }
}

/// Drawing is slow without a GPU: cameras rest while no picture is due. One frame more, as the first of a camera is empty.
fn draw_when_due(film: Res<Film>, output: Res<Output>, arguments: Res<DemoArguments>, mut cameras: Query<&mut Camera>) {
    if *output == Output::Offscreen {
        let due = (film.frame + 1..=film.frame + 2).any(|frame| arguments.is_due(frame));
        for mut camera in &mut cameras {
            camera.is_active = due;
        }
    }
}

fn take_picture(
    mut film: ResMut<Film>,
    output: Res<Output>,
    arguments: Res<DemoArguments>,
    images: Res<Assets<Image>>,
    shown: Query<(&GlobalTransform, &OnCanvas, Option<&CrackTextures>)>,
    mut commands: Commands,
) {
    film.frame += 1;
    if *output == Output::Window || !arguments.is_due(film.frame) {
        return;
    }
    match film.target.clone() {
        Some(target) => {
            film.awaited += 1;
            commands.spawn(Screenshot::image(target)).observe(
                |captured: On<ScreenshotCaptured>, mut film: ResMut<Film>, arguments: Res<DemoArguments>| {
                    film.awaited = film.awaited.saturating_sub(1);
                    if let Ok(picture) = captured.image.clone().try_into_dynamic() {
                        film.add(picture.to_rgba8(), &arguments);
                    }
                },
            );
        }
        None => {
            let picture = composite(&images, UVec2::new(WIDTH, arguments.height()), shown.iter());
            film.add(picture, &arguments);
        }
    }
}

impl Film {
    #[expect(clippy::print_stderr, reason = "a demo says what went wrong")]
    fn add(&mut self, picture: RgbaImage, arguments: &DemoArguments) {
        let last = arguments.frames / arguments.step();
        // Six stills over the run; the last picture among them.
        let step = (last / 6).max(1) as usize;
        if self.strip.len() % step == step - 1 {
            self.stills += 1;
            if let Err(error) = write_still(&picture, &arguments.out, self.stills) {
                eprintln!("{}: {error}", arguments.out.display());
            }
        }
        let width = arguments.width.clamp(1, WIDTH);
        let height = width * picture.height() / picture.width().max(1);
        self.strip.push(imageops::resize(&picture, width, height.max(1), FilterType::Triangle));
    }
}

fn write_still(picture: &RgbaImage, out: &Path, number: u32) -> image::ImageResult<()> {
    fs::create_dir_all(out)?;
    picture.save(out.join(format!("still_{number}.png")))
}

/// Writes the GIF of a run.
fn write_film(strip: &[RgbaImage], arguments: &DemoArguments, path: &Path) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(&arguments.out)?;
    let hundredths = (100 * arguments.step() / RATE).clamp(2, LONGEST);
    Ok(moving::write_gif(strip, hundredths as u16, path)?)
}

#[expect(clippy::print_stdout, clippy::print_stderr, reason = "a demo says what it wrote")]
fn end(mut film: ResMut<Film>, output: Res<Output>, arguments: Res<DemoArguments>, mut exit: MessageWriter<AppExit>) {
    if *output == Output::Window {
        if arguments.exit_after.is_some_and(|frames| film.frame >= frames) {
            exit.write(AppExit::Success);
        }
        return;
    }
    // Pictures come a few frames after they were asked for.
    let late = film.awaited > 0 && film.frame < arguments.frames + 60;
    if film.frame < arguments.frames || late {
        return;
    }
    let path = arguments.out.join("film.gif");
    let written = write_film(&std::mem::take(&mut film.strip), &arguments, &path);
    match written {
        Ok(()) => {
            println!("Wrote {} pictures and {}.", film.stills, path.display());
            exit.write(AppExit::Success);
        }
        Err(error) => {
            eprintln!("{}: {error}", path.display());
            exit.write(AppExit::error());
        }
    }
}

/// Lays the CPU copies of the surfaces' pictures out as they stand in the world, seen from the front.
fn composite<'a>(
    images: &Assets<Image>,
    canvas: UVec2,
    shown: impl Iterator<Item = (&'a GlobalTransform, &'a OnCanvas, Option<&'a CrackTextures>)>,
) -> RgbaImage {
    let center = canvas.as_vec2() / 2.0;
    let mut canvas = RgbaImage::from_pixel(canvas.x, canvas.y, image::Rgba([38, 42, 48, 255]));
    let mut layers: Vec<_> = shown.collect();
    layers.sort_by(|a, b| a.0.translation().z.total_cmp(&b.0.translation().z));
    for (transform, surface, cracked) in layers {
        let handle = cracked.and_then(|textures| textures.diffuse.clone()).unwrap_or_else(|| surface.picture.clone());
        let Some(Ok(picture)) = images.get(&handle).map(|image| image.clone().try_into_dynamic()) else { continue };
        let size = (surface.size * transform.scale().truncate()).abs().as_uvec2().max(UVec2::ONE);
        let picture = imageops::resize(&picture.to_rgba8(), size.x, size.y, FilterType::Triangle);
        let middle = center + transform.translation().truncate() * Vec2::new(1.0, -1.0);
        let corner = (middle - size.as_vec2() / 2.0).as_ivec2();
        imageops::overlay(&mut canvas, &picture, i64::from(corner.x), i64::from(corner.y));
    }
    canvas
}
