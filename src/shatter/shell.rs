//! Shards of a surface that is not flat: it is cut where it is laid out in a plane, and its pieces are curved.

use super::sides::{Side, SideEnd, facing, unevenness};
use super::{MeshFrame, RimLook, Shards};
use glam::{Affine3A, DVec2, UVec2, Vec2, Vec3};
use std::collections::HashMap;

/// A triangle of a [`Shell`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShellTriangle {
    /// Its corners where it is laid out, pattern units, y down.
    pub flat: [Vec2; 3],
    /// Its corners in space, counter-clockwise as seen from outside.
    pub corners: [Vec3; 3],
    /// Unit normals at its corners, outward. Those that are not finite or zero count as the triangle's own.
    pub normals: [Vec3; 3],
}

/// A surface that is not flat, and how it is laid out in the plane in which cracks grow: a box, a jar, a room.
///
/// The plane is cut into [`Shards`] as that of a flat surface is; [`Shards::shell_mesh`] makes curved pieces of them. Where the layout ends,
/// [`border`](Self::border), it has to be cut as well, or pieces of different parts of the surface would be one.
///
/// ```
/// use bevy_crack::shatter::{Cuts, Shell, ShellFrame, ShellMesh, ShellPart, ShellPlace, ShellTriangle, ShatterParams, shatter};
/// use glam::{Vec2, Vec3};
///
/// // Two squares that meet at a right angle, laid out side by side, and cut across the edge.
/// let square = |x: f32, right: Vec3, origin: Vec3, normal: Vec3| {
///     let corner = |u: f32, v: f32| (Vec2::new(x + u, 1.0 - v), origin + right * u + Vec3::Y * v);
///     [[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)], [(0.0, 0.0), (1.0, 1.0), (0.0, 1.0)]].map(|corners| ShellTriangle {
///         flat: corners.map(|(u, v)| corner(u, v).0),
///         corners: corners.map(|(u, v)| corner(u, v).1),
///         normals: [normal; 3],
///     })
/// };
/// let front = square(0.0, Vec3::X, Vec3::ZERO, Vec3::Z);
/// let side = square(1.0, Vec3::NEG_Z, Vec3::X, Vec3::X);
/// let shell = Shell::new([2.0, 1.0].into(), front.into_iter().chain(side));
/// let mut cuts = Cuts::new([2.0, 1.0].into())?;
/// cuts.add_line(&[[0.0, 0.5].into(), [2.0, 0.5].into()])?;
/// for edge in shell.border() {
///     cuts.add_line(&edge)?;
/// }
/// let shards = shatter(cuts, &ShatterParams::DEFAULT)?;
/// assert_eq!(shards.len(), 2);
/// let mesh: ShellMesh = shards.shell_mesh(0, &shell, &ShellFrame { thickness: 0.1, ..Default::default() });
/// // It reaches around the edge, and has an inside.
/// let ShellPart { positions, .. } = &mesh.picture;
/// assert!(positions.iter().any(|[x, _, _]| *x == 0.0) && positions.iter().any(|[_, _, z]| *z == -1.0));
/// assert!(!mesh.inside.indices.is_empty() && !shell.is_empty());
/// // A place of the second square: there the plane goes on to the back, not to the right.
/// let ShellPlace { position, normal, right, .. } = shell.place([1.5, 0.5].into()).expect("it is laid out");
/// assert_eq!((position, normal, right), (Vec3::new(1.0, 0.5, -0.5), Vec3::X, Vec3::NEG_Z));
/// // From a point above its left corner to the upper half.
/// let upper = shards.at([0.5, 0.25].into()).expect("a shard");
/// assert_eq!(shell.distance(&shards, upper, Vec3::new(0.0, 1.5, 0.0)), Some(0.5));
/// # Ok::<(), bevy_crack::shatter::ShatterError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Shell {
    extent: Vec2,
    triangles: Vec<ShellTriangle>,
    /// Which edges of each triangle, from a corner to the next one, nothing lies beyond.
    ends: Vec<[bool; 3]>,
    /// Triangles of each cell, row by row.
    grid: CellLists,
    /// Length of a pattern unit in space, on the whole.
    unit: f32,
}

/// A place on a [`Shell`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShellPlace {
    /// Where it is.
    pub position: Vec3,
    /// The unit normal of its triangle, outward.
    pub normal: Vec3,
    /// How far it goes on in space for each pattern unit to the right in the plane.
    pub right: Vec3,
    /// The same downward.
    pub down: Vec3,
}

/// How the shards of a [`Shell`] become meshes. By default nothing is moved, a whole texture is shown, rims are
/// [plain](RimLook::PLAIN), and all numbers are 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShellFrame {
    /// From the shell's space to the mesh's: turned and moved, not scaled.
    pub to_mesh: Affine3A,
    /// Texture coordinates of the plane's top left and bottom right corner.
    pub uv: [Vec2; 2],
    /// How rims look; they do not slope.
    pub rim: RimLook,
    /// Seed as that of [`MeshFrame::seed`].
    pub seed: u64,
    /// How far pieces reach inward from the surface, in the shell's units, 0 or more.
    pub thickness: f32,
    /// How uneven their inside and the faces along which they broke are, 0..=1; pieces fit all the same.
    pub roughness: f32,
}

impl Default for ShellFrame {
    fn default() -> Self {
        Self {
            to_mesh: Affine3A::IDENTITY,
            uv: [Vec2::ZERO, Vec2::ONE],
            rim: RimLook::PLAIN,
            seed: 0,
            thickness: 0.0,
            roughness: 0.0,
        }
    }
}

/// The least thickness of pieces that are uneven, pattern units: how uneven they are is in proportion to it.
const LEAST_THICKNESS: f32 = 1e-6;

impl ShellFrame {
    /// How uneven the pieces are of a shell whose pattern unit is so long: those without thickness are smooth.
    fn roughness_of(&self, unit: f32) -> f32 {
        if self.thickness > LEAST_THICKNESS * unit { self.roughness } else { 0.0 }
    }
}

/// A part of a [`ShellMesh`]: a triangle list, counter-clockwise as seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShellPart {
    /// Positions of the vertices.
    pub positions: Vec<[f32; 3]>,
    /// Unit vectors.
    pub normals: Vec<[f32; 3]>,
    /// Unit vectors along which u grows, and the side on which v does not: -1 or 1.
    pub tangents: Vec<[f32; 4]>,
    /// Texture coordinates, v down.
    pub uvs: Vec<[f32; 2]>,
    /// Factors for the picture's colour; empty without a rim, and for the inside.
    pub colors: Vec<[f32; 4]>,
    /// Indices of vertices, three per triangle.
    pub indices: Vec<u32>,
}

/// A piece of a [`Shell`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShellMesh {
    /// Its outside, which shows the picture.
    pub picture: ShellPart,
    /// Its inside, whose texture coordinates are places in the plane, and its sides, where u runs along the edge and v from 0 outside to the
    /// inside: all in pattern units.
    pub inside: ShellPart,
}

/// Ends of edges that lie no further apart where they are laid out are one, pattern units.
const SLACK: f32 = 1e-4;

/// How far beyond an edge of a triangle a place may lie that is in it, as a share of its height.
const OUTSIDE: f32 = 1e-4;

/// Pieces of triangles of less area show nothing, pattern units squared.
const LEAST_AREA: f64 = 1e-12;

/// A corner of a part of a shard.
#[derive(Clone, Copy)]
struct Corner {
    at: DVec2,
    /// Weights of the corners of the shard's triangle.
    weights: [f64; 3],
    /// Whether the edge to the next corner is one of the piece.
    is_edge: bool,
}

impl Shell {
    /// A surface that is laid out in a plane of `extent`, pattern units. Triangles without area, in space or in the plane, and with numbers
    /// that are not finite, are left out.
    #[must_use]
    pub fn new(extent: Vec2, triangles: impl IntoIterator<Item = ShellTriangle>) -> Self {
        let triangles: Vec<ShellTriangle> = triangles.into_iter().filter_map(ShellTriangle::checked).collect();
        // Edges of the same two points, whichever way they run.
        let mut edges: HashMap<[[u32; 3]; 2], Vec<[Vec2; 2]>> = HashMap::new();
        for triangle in &triangles {
            for i in 0..3 {
                let (key, flat) = triangle.edge(i);
                edges.entry(key).or_default().push(flat);
            }
        }
        let is_end = |triangle: &ShellTriangle, i: usize| {
            let (key, [a, b]) = triangle.edge(i);
            let is_same = |other: &&[Vec2; 2]| other[0].distance(a) <= SLACK && other[1].distance(b) <= SLACK;
            edges.get(&key).is_none_or(|all| all.iter().filter(is_same).count() < 2)
        };
        let ends = triangles.iter().map(|triangle| [0, 1, 2].map(|i| is_end(triangle, i))).collect();
        let grid = CellLists::new(extent, triangles.iter().map(|triangle| triangle.flat));
        let area = |of: fn(&ShellTriangle) -> f32| triangles.iter().map(of).sum::<f32>();
        let [space, flat] = [
            area(|of| (of.corners[1] - of.corners[0]).cross(of.corners[2] - of.corners[0]).length()),
            area(|of| (of.flat[1] - of.flat[0]).perp_dot(of.flat[2] - of.flat[0]).abs()),
        ];
        let unit = (space / flat.max(f32::MIN_POSITIVE)).sqrt();
        Self { extent, triangles, ends, grid, unit }
    }

    /// Whether there is nothing of it.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// The edges at which the layout ends, pattern units.
    pub fn border(&self) -> impl Iterator<Item = [Vec2; 2]> + '_ {
        let edges = |(triangle, ends): (&ShellTriangle, &[bool; 3])| {
            let flat = triangle.flat;
            (0..3).zip(*ends).filter(|(_, is_end)| *is_end).map(move |(i, _)| [flat[i], flat[(i + 1) % 3]])
        };
        self.triangles.iter().zip(&self.ends).flat_map(edges)
    }

    /// The place that is laid out at `pos`, pattern units; `None` if there is none.
    #[must_use]
    pub fn place(&self, pos: Vec2) -> Option<ShellPlace> {
        let mut best: Option<(f32, &ShellTriangle, [f32; 3])> = None;
        for &i in self.grid.at(pos) {
            let triangle = &self.triangles[i as usize];
            let weights = triangle.weights(pos);
            let least = weights.into_iter().fold(f32::INFINITY, f32::min);
            let is_in = weights.iter().all(|weight| *weight >= -OUTSIDE);
            if is_in && best.is_none_or(|(most, ..)| least > most) {
                best = Some((least, triangle, weights));
            }
        }
        let (_, triangle, weights) = best?;
        Some(triangle.place(weights))
    }

    /// The least distance from `point` to a shard, about: to its corners and to a point of it, in the shell's units. `None` if the shard lies
    /// where nothing is laid out.
    #[must_use]
    pub fn distance(&self, shards: &Shards, shard: u32, point: Vec3) -> Option<f32> {
        let inner = self.place(shards.inner_point(shard)?)?.position.distance(point);
        let corners =
            shards.corners(shard).iter().filter_map(|&corner| self.place(shards.positions()[corner as usize]));
        Some(corners.map(|place| place.position.distance(point)).fold(inner, f32::min))
    }
}

impl ShellTriangle {
    fn checked(mut self) -> Option<Self> {
        let own = self.normal();
        let is_finite = self.flat.iter().all(|at| at.is_finite()) && self.corners.iter().all(|at| at.is_finite());
        let turn = (self.flat[1] - self.flat[0]).perp_dot(self.flat[2] - self.flat[0]);
        if !is_finite || own == Vec3::ZERO || f64::from(turn.abs()) < LEAST_AREA {
            return None;
        }
        for normal in &mut self.normals {
            *normal = normal.try_normalize().unwrap_or(own);
        }
        Some(self)
    }

    /// Zero for one without area.
    fn normal(&self) -> Vec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// An edge by the points at its ends, and where it is laid out, in the same order.
    fn edge(&self, i: usize) -> ([[u32; 3]; 2], [Vec2; 2]) {
        let k = (i + 1) % 3;
        // 0 and -0 are the same.
        let key = |i: usize| self.corners[i].to_array().map(|value| (value + 0.0).to_bits());
        let (a, b) = (key(i), key(k));
        if a <= b { ([a, b], [self.flat[i], self.flat[k]]) } else { ([b, a], [self.flat[k], self.flat[i]]) }
    }

    /// Weights of its corners at a place in the plane.
    fn weights(&self, pos: Vec2) -> [f32; 3] {
        let [a, b, c] = self.flat;
        let area = (b - a).perp_dot(c - a);
        let (v, w) = ((pos - a).perp_dot(c - a) / area, (b - a).perp_dot(pos - a) / area);
        [1.0 - v - w, v, w]
    }

    fn position(&self, [u, v, w]: [f32; 3]) -> Vec3 {
        let [a, b, c] = self.corners;
        a * u + b * v + c * w
    }

    fn place(&self, weights: [f32; 3]) -> ShellPlace {
        let ([a, b, c], [p, q, r]) = (self.corners, self.flat);
        let area = (q - p).perp_dot(r - p);
        // How the weights of the second and third corner grow to the right and downward.
        let along = |way: Vec2| (b - a) * (way.perp_dot(r - p) / area) + (c - a) * ((q - p).perp_dot(way) / area);
        ShellPlace {
            position: self.position(weights),
            normal: self.normal(),
            right: along(Vec2::X),
            down: along(Vec2::Y),
        }
    }

    /// The part of a polygon that lies in it, corner by corner; `ends` are its edges that end the layout.
    fn clip(&self, ends: [bool; 3], polygon: &mut Vec<Corner>, spare: &mut Vec<Corner>) {
        let flat = self.flat.map(Vec2::as_dvec2);
        let turn = (flat[1] - flat[0]).perp_dot(flat[2] - flat[0]).signum();
        for i in 0..3 {
            let (p, q) = (flat[i], flat[(i + 1) % 3]);
            let inside = |corner: &Corner| (q - p).perp_dot(corner.at - p) * turn;
            spare.clear();
            for k in 0..polygon.len() {
                let (from, to) = (polygon[k], polygon[(k + 1) % polygon.len()]);
                let (a, b) = (inside(&from), inside(&to));
                if a >= 0.0 {
                    spare.push(from);
                }
                if (a >= 0.0) != (b >= 0.0) {
                    let share = a / (a - b);
                    let mix = |a: f64, b: f64| a + (b - a) * share;
                    let weights = [0, 1, 2].map(|i| mix(from.weights[i], to.weights[i]));
                    // Where it leaves, the next edge is the triangle's.
                    let is_edge = if a >= 0.0 { ends[i] } else { from.is_edge };
                    spare.push(Corner { at: from.at.lerp(to.at, share), weights, is_edge });
                }
            }
            core::mem::swap(polygon, spare);
        }
    }
}

impl ShellPart {
    pub(super) fn push(&mut self, at: Vec3, normal: Vec3, tangent: [f32; 4], uv: [f32; 2]) -> u32 {
        let index = self.positions.len() as u32;
        self.positions.push(at.to_array());
        self.normals.push(normal.to_array());
        self.tangents.push(tangent);
        self.uvs.push(uv);
        index
    }

    /// Adds the triangles of a convex polygon.
    pub(super) fn fill(&mut self, corners: &[u32], is_turned: bool) {
        for i in 1..corners.len().saturating_sub(1) {
            let [a, b, c] = [corners[0], corners[i], corners[i + 1]];
            self.indices.extend(if is_turned { [a, c, b] } else { [a, b, c] });
        }
    }
}

/// A vertex of the outside.
struct Vertex {
    at: Vec3,
    normal: Vec3,
    uv: [f32; 2],
    flat: Vec2,
    /// The way out of the piece along the surface, on the whole; zero but for its edges.
    out: Vec3,
}

impl Shards {
    /// A shard of a surface that was laid out to be cut: as much of the shell as lies in it, with sides all around and an inside
    /// `thickness` below. Empty where nothing is laid out.
    #[must_use]
    pub fn shell_mesh(&self, shard: u32, shell: &Shell, frame: &ShellFrame) -> ShellMesh {
        let mut made = ShellMesh::default();
        let extent = self.extent();
        // In the plane, with its rim.
        let plane =
            MeshFrame { uv: frame.uv, centred: false, rim: frame.rim, seed: frame.seed, ..MeshFrame::new(extent) };
        let flat = self.flat_mesh(shard, &plane);
        let place = |i: usize| Vec2::new(flat.positions[i][0] + 0.5 * extent.x, 0.5 * extent.y - flat.positions[i][1]);
        let next = self.next_corners(shard);
        let outward = if frame.roughness_of(shell.unit) > 0.0 {
            self.outward(shard, SMOOTHED * frame.thickness / shell.unit)
        } else {
            Vec::new()
        };
        let (mut polygon, mut spare) = (Vec::new(), Vec::new());
        for triangle in flat.indices.as_chunks::<3>().0 {
            // Turning from x to y.
            let corners = [triangle[0], triangle[2], triangle[1]].map(|i| i as usize);
            let places = corners.map(place);
            let is_edge = |i: usize| {
                let (from, to) = (corners[i], corners[(i + 1) % 3]);
                next.get(from) == Some(&to) || next.get(to) == Some(&from)
            };
            let whole: [Corner; 3] = core::array::from_fn(|i| Corner {
                at: places[i].as_dvec2(),
                weights: core::array::from_fn(|k| f64::from(u8::from(i == k))),
                is_edge: is_edge(i),
            });
            shell.grid.for_each_in(places, |i| {
                let of = &shell.triangles[i as usize];
                polygon.clear();
                polygon.extend(whole);
                of.clip(shell.ends[i as usize], &mut polygon, &mut spare);
                let has_area = area(&polygon) >= LEAST_AREA;
                let mix = |weights: [f64; 3], of: &dyn Fn(usize) -> f32| {
                    (0..3).map(|k| weights[k] as f32 * of(corners[k])).sum::<f32>()
                };
                let uv = |weights| [0, 1].map(|axis| mix(weights, &|i| flat.uvs[i][axis]));
                let color = |weights| [0, 1, 2, 3].map(|axis| mix(weights, &|i| flat.colors[i][axis]));
                let out = |weights: [f64; 3]| {
                    let out = |i: usize| outward.get(corners[i]).copied().unwrap_or_default();
                    (0..3).map(|i| weights[i] as f32 * out(i)).sum::<Vec2>()
                };
                made.add(of, (&polygon, has_area), (frame, shell.unit), (uv, out));
                if has_area && !flat.colors.is_empty() {
                    made.picture.colors.extend(polygon.iter().map(|corner| color(corner.weights)));
                }
            });
        }
        made
    }

    /// The corner that follows each one along its ring, counted as in [`corners`](Self::corners).
    fn next_corners(&self, shard: u32) -> Vec<usize> {
        let mut next = Vec::with_capacity(self.corners(shard).len());
        for ring in self.rings_of(shard) {
            let (first, n) = (next.len(), ring.len());
            next.extend((0..n).map(|i| first + (i + 1) % n));
        }
        next
    }
}

/// Over how much of their outline the sides of pieces are lit as if they were smooth, thicknesses: kinks of cracks reach less deep.
const SMOOTHED: f32 = 0.35;

/// Twice the area, of a polygon that turns from x to y.
fn area(polygon: &[Corner]) -> f64 {
    let Some(first) = polygon.first() else { return 0.0 };
    polygon.windows(2).map(|pair| (pair[0].at - first.at).perp_dot(pair[1].at - first.at)).sum()
}

impl ShellMesh {
    /// Adds the part of a triangle; of one without area, as rims have them, the sides.
    fn add(
        &mut self,
        of: &ShellTriangle,
        (polygon, has_area): (&[Corner], bool),
        (frame, unit): (&ShellFrame, f32),
        (uv, out): (impl Fn([f64; 3]) -> [f32; 2], impl Fn([f64; 3]) -> Vec2),
    ) {
        let turn = (of.flat[1] - of.flat[0]).perp_dot(of.flat[2] - of.flat[0]);
        // A polygon turns from x to y, the triangle counter-clockwise as seen from outside.
        let is_turned = turn < 0.0;
        let ShellPlace { right, down, .. } = of.place([1.0, 0.0, 0.0]);
        let turned = |way: Vec3| frame.to_mesh.transform_vector3(way).normalize_or_zero();
        let vertices: Vec<Vertex> = polygon
            .iter()
            .map(|corner| {
                let (flat, out) = (corner.at.as_vec2(), out(corner.weights));
                let weights = of.weights(flat);
                let normal = (0..3).map(|i| of.normals[i] * weights[i]).sum::<Vec3>();
                Vertex {
                    at: frame.to_mesh.transform_point3(of.position(weights)),
                    normal: turned(normal.try_normalize().unwrap_or(of.normals[0])),
                    uv: uv(corner.weights),
                    flat,
                    out: turned(right * out.x + down * out.y),
                }
            })
            .collect();
        // u runs to the right, v downward: laid out as it is seen from outside, the green of a normal map points up.
        let handedness = if is_turned { 1.0 } else { -1.0 };
        let tangent = |normal: Vec3, way: Vec3| {
            let along = (way - normal * way.dot(normal)).normalize_or(normal.any_orthonormal_vector());
            along.extend(handedness).to_array()
        };
        let along = turned(right);
        // What is uneven is lit face by face.
        let roughness = frame.roughness_of(unit);
        let is_rough = roughness > 0.0;
        let below = |vertex: &Vertex| {
            let (aside, rough) = (unevenness(vertex.flat, frame.thickness / unit), roughness * frame.thickness);
            let aside = frame.to_mesh.transform_vector3(aside);
            let along = aside.reject_from_normalized(vertex.normal);
            vertex.at - vertex.normal * (frame.thickness + 0.35 * rough * aside.dot(vertex.normal)) + along * rough
        };
        let under: Vec<Vec3> = vertices.iter().map(below).collect();
        if has_area {
            let outside: Vec<u32> = vertices
                .iter()
                .map(|vertex| self.picture.push(vertex.at, vertex.normal, tangent(vertex.normal, along), vertex.uv))
                .collect();
            self.picture.fill(&outside, is_turned);
            let bottom = facing(&under).map(|facing| if is_turned { facing } else { -facing });
            let inside: Vec<u32> = vertices
                .iter()
                .zip(&under)
                .map(|(vertex, under)| {
                    let normal = bottom.filter(|_| is_rough).unwrap_or(-vertex.normal);
                    self.inside.push(*under, normal, tangent(normal, along), vertex.flat.to_array())
                })
                .collect();
            self.inside.fill(&inside, !is_turned);
        }
        let side = Side { is_turned, roughness, thickness: frame.thickness, unit };
        for (i, _) in polygon.iter().enumerate().filter(|(_, corner)| corner.is_edge) {
            let k = (i + 1) % vertices.len();
            let end = |i: usize| SideEnd {
                at: vertices[i].at,
                normal: vertices[i].normal,
                under: under[i],
                flat: vertices[i].flat,
                out: vertices[i].out,
            };
            side.add([end(i), end(k)], &frame.to_mesh, &mut self.inside);
        }
    }
}

/// Which triangles lie in which cells of a plane.
#[derive(Clone, Debug, PartialEq)]
struct CellLists {
    /// Cells for a pattern unit.
    scale: Vec2,
    size: UVec2,
    /// Where the triangles of each cell begin; one more at the end.
    starts: Vec<u32>,
    items: Vec<u32>,
}

/// The most cells along a side.
const MOST_CELLS: f32 = 256.0;

impl CellLists {
    fn new(extent: Vec2, triangles: impl ExactSizeIterator<Item = [Vec2; 3]> + Clone) -> Self {
        // About as many cells as triangles.
        let n = (triangles.len() as f32).sqrt().clamp(1.0, MOST_CELLS);
        let size = (n * extent / extent.max_element()).ceil().clamp(Vec2::ONE, Vec2::splat(MOST_CELLS)).as_uvec2();
        let mut lists = Self { scale: size.as_vec2() / extent, size, starts: Vec::new(), items: Vec::new() };
        let mut counts = vec![0u32; size.element_product() as usize + 1];
        for corners in triangles.clone() {
            lists.cells(corners).for_each(|cell| counts[cell + 1] += 1);
        }
        for i in 1..counts.len() {
            counts[i] += counts[i - 1];
        }
        let mut free = counts.clone();
        lists.items = vec![0; counts.last().map_or(0, |n| *n as usize)];
        for (number, corners) in (0..).zip(triangles) {
            for cell in lists.cells(corners) {
                lists.items[free[cell] as usize] = number;
                free[cell] += 1;
            }
        }
        lists.starts = counts;
        lists
    }

    fn cell(&self, pos: Vec2) -> UVec2 {
        (pos * self.scale).max(Vec2::ZERO).as_uvec2().min(self.size - 1)
    }

    /// The cells around some points.
    fn cells(&self, points: [Vec2; 3]) -> impl Iterator<Item = usize> + use<> {
        let [a, b, c] = points;
        // What lies on the border of a cell is found from both sides.
        let (min, max) = (self.cell(a.min(b).min(c) - SLACK), self.cell(a.max(b).max(c) + SLACK));
        let width = self.size.x as usize;
        (min.y..=max.y).flat_map(move |y| (min.x..=max.x).map(move |x| y as usize * width + x as usize))
    }

    fn of(&self, cell: usize) -> &[u32] {
        &self.items[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    fn at(&self, pos: Vec2) -> &[u32] {
        let cell = self.cell(pos);
        self.of(cell.y as usize * self.size.x as usize + cell.x as usize)
    }

    /// Calls `found` once with each triangle of the cells around some points, in order.
    fn for_each_in(&self, points: [Vec2; 3], mut found: impl FnMut(u32)) {
        let mut cells = self.cells(points);
        let Some(first) = cells.next() else { return };
        let Some(second) = cells.next() else { return self.of(first).iter().copied().for_each(found) };
        let mut all: Vec<u32> =
            [first, second].into_iter().chain(cells).flat_map(|cell| self.of(cell)).copied().collect();
        all.sort_unstable();
        all.dedup();
        all.into_iter().for_each(&mut found);
    }
}
