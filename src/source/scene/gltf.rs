//! glTF 2.0, binary and text, through the checked reader of [`crate::source::glb`].
//!
//! Read are triangles, strips and fans with positions, normals, colours and the texture coordinates of the colour
//! picture (moved as KHR_texture_transform says); materials with factor, pictures, alpha mode and cut-off; node
//! transforms. Each part keeps the vertices that its triangles use, in the file's order: several primitives may share one
//! buffer. Levels of detail by MSFT_lod are not in the scene and so not read.
//!
//! A mesh that is placed many times is read as often. What all parts take may not exceed 10 times the size of all files:
//! beyond that the file is refused, since a few bytes may place a large mesh once more.

use glam::{Vec2, Vec3};

use super::{Alpha, Files, Image, Material, Object, Part, Scene, SceneUp, Transmission};
use crate::base::{Diagnostic, math};
use crate::preset::plan::UpAxis;
use crate::source::glb::look::{Picture, Placing};
use crate::source::glb::{GlbError, GlbInfo, Instance, read_with};

/// Bytes of parts for each byte of files, and beside that.
const MOST: (usize, usize) = (10, 512 << 10);

/// Whether a text is a JSON object with a member `asset` near one of its ends.
pub(super) fn is_gltf(text: &[u8]) -> bool {
    let near = |text: &[u8]| text.windows(7).any(|w| w == b"\"asset\"");
    let end = text.len().saturating_sub(4096);
    text.trim_ascii_start().starts_with(b"{")
        && (near(&text[..text.len().min(4096)]) || near(&text[end..]) || near(text))
}

/// The buffers and pictures that a file names.
pub(super) fn refers(bytes: &[u8]) -> Vec<String> {
    crate::source::glb::named_files(bytes)
}

/// Reads a glTF; see [`super::read`].
pub(super) fn read(bytes: &[u8], file: &str, files: &Files<'_>) -> Result<Scene, Vec<Diagnostic>> {
    let fail = |e: GlbError| vec![Diagnostic::new(file, e.to_string()).with_hint(e.help())];
    let mut info = read_with(bytes, files).map_err(fail)?;
    let mut scene = Scene { up: SceneUp(UpAxis::Y), ..Scene::default() };
    if !info.look.unread.is_empty() {
        // Compressed data says so itself where it is read.
        scene.notes.push(format!("the file requires {}, which is not read", info.look.unread.join(", ")));
    }
    for (stated, _) in info.materials.iter().zip(&info.look.materials).filter(|(_, wear)| wear.is_less) {
        scene.notes.push(format!(
            "material {}: a normal or roughness map lies otherwise than the colour picture, and is left out",
            stated.name
        ));
    }
    let all: usize = bytes.len() + files.values().map(|b| b.len()).sum::<usize>();
    let mut left = MOST.0 * all + MOST.1;
    materials(&info, &mut scene);
    pictures(&info, &mut scene, &mut left).map_err(fail)?;
    let nodes = std::mem::take(&mut info.nodes);
    spend(&mut left, nodes.len() * size_of::<Object>()).map_err(fail)?;
    scene.objects = nodes.into_iter().map(|(name, parent)| Object { name, parent }).collect();
    let mut used = Used::default();
    for instance in &info.instances {
        for primitive in 0..info.meshes[instance.mesh].primitives.len() {
            let mut part = part(&info, instance, primitive, &mut used, &mut left).map_err(fail)?;
            if info.below > 0.0 {
                unsink(&mut part, info.below, &mut used);
            }
            if !part.triangles.is_empty() {
                scene.parts.push(part);
            }
        }
    }
    super::keep_used(&mut scene);
    Ok(scene)
}

fn materials(info: &GlbInfo<'_>, scene: &mut Scene) {
    for (stated, wear) in info.materials.iter().zip(&info.look.materials) {
        scene.materials.push(Material {
            name: stated.name.clone(),
            alpha: match stated.alpha_mode.as_str() {
                "MASK" => Alpha::Mask(stated.alpha_cutoff),
                "BLEND" => Alpha::Blend,
                _ => Alpha::Opaque,
            },
            double_sided: stated.double_sided,
            color: wear.color.map(|c| if c.is_finite() { c.clamp(0.0, 1.0) } else { 1.0 }),
            color_image: wear.color_image,
            normal_image: wear.normal_image,
            roughness_image: wear.roughness_image,
            alpha_image: None,
            transmission: wear.transmission.map(|(factor, image, channel)| Transmission { factor, image, channel }),
        });
    }
}

/// Copies the pictures that materials wear; the others become files of no name and are dropped with what nobody uses.
fn pictures(info: &GlbInfo<'_>, scene: &mut Scene, left: &mut usize) -> Result<(), GlbError> {
    let mut worn = vec![false; info.look.images.len()];
    for wear in &info.look.materials {
        let through = wear.transmission.and_then(|(_, image, _)| image);
        for image in [wear.color_image, wear.normal_image, wear.roughness_image, through].into_iter().flatten() {
            worn[image] = true;
        }
    }
    for (picture, worn) in info.look.images.iter().zip(worn) {
        let embedded = match picture {
            Picture::View(buffer, start, length) if worn => info.bytes(*buffer, *start, *length),
            Picture::Inline(bytes) if worn => Some(bytes.as_slice()),
            _ => None,
        };
        spend(left, embedded.map_or(0, <[u8]>::len))?;
        scene.images.push(match (picture, embedded) {
            (_, Some(bytes)) => Image::Embedded(bytes.to_vec()),
            (Picture::File(name), _) => Image::File(name.clone()),
            _ => Image::Embedded(Vec::new()),
        });
    }
    Ok(())
}

fn spend(left: &mut usize, bytes: usize) -> Result<(), GlbError> {
    *left = left.checked_sub(bytes).ok_or_else(|| {
        GlbError::Unsupported(
            "it shows the same data over and over, far beyond its size: join the copies into one mesh before exporting"
                .to_owned(),
        )
    })?;
    Ok(())
}

/// Which vertices a primitive uses; kept between primitives, so that many small ones of one large buffer stay cheap.
#[derive(Default)]
struct Used {
    /// For each vertex the primitive that used it last, and its new index there.
    marks: Vec<(u32, u32)>,
    primitive: u32,
    list: Vec<u32>,
}

impl Used {
    /// Renumbers the corners; the vertices that are left, in rising order.
    fn keep(&mut self, triangles: &mut [[u32; 3]]) -> &[u32] {
        self.primitive = self.primitive.wrapping_add(1);
        self.list.clear();
        for &corner in triangles.iter().flatten() {
            let at = corner as usize;
            if at >= self.marks.len() {
                self.marks.resize(at + 1, (0, 0));
            }
            if self.marks[at].0 != self.primitive {
                self.marks[at].0 = self.primitive;
                self.list.push(corner);
            }
        }
        self.list.sort_unstable();
        for (new, &old) in self.list.iter().enumerate() {
            self.marks[old as usize].1 = new as u32;
        }
        for corner in triangles.iter_mut().flatten() {
            *corner = self.marks[*corner as usize].1;
        }
        &self.list
    }
}

fn part(
    info: &GlbInfo<'_>,
    instance: &Instance,
    primitive: usize,
    used: &mut Used,
    left: &mut usize,
) -> Result<Part, GlbError> {
    let mesh = instance.mesh;
    let stated = &info.meshes[mesh].primitives[primitive];
    let name = if instance.node.is_empty() { &info.meshes[mesh].name } else { &instance.node };
    spend(left, size_of::<Part>() + name.len())?;
    spend(left, usize::try_from(stated.triangles).unwrap_or(usize::MAX).saturating_mul(28))?;
    let mut triangles = info.triangles(mesh, primitive)?;
    let vertices = used.keep(&mut triangles);
    spend(left, vertices.len() * 32)?;
    let some = Some(vertices);
    let three = |name: &str| {
        let found = info.attribute::<3>(mesh, primitive, name, some)?.filter(|(_, n)| *n == 3);
        Ok(found.map(|(v, _)| v.into_iter().map(Vec3::from_array).collect::<Vec<_>>()).unwrap_or_default())
    };
    let placing = stated.material.map(|m| info.look.materials[m].placing).unwrap_or_default();
    let uvs = info.attribute::<2>(mesh, primitive, &format!("TEXCOORD_{}", placing.set), some)?;
    let colors = info.attribute::<4>(mesh, primitive, "COLOR_0", some)?;
    let mut part = Part {
        name: name.clone(),
        object: instance.at,
        material: stated.material,
        positions: three("POSITION")?,
        normals: three("NORMAL")?,
        uvs: uvs.filter(|(_, n)| *n == 2).map(|(v, _)| placed(v, placing)).unwrap_or_default(),
        colors: colors.map(|(colors, n)| opaque(colors, n)).unwrap_or_default(),
        faces: (0..triangles.len() as u32).collect(),
        triangles,
    };
    place(&mut part, instance);
    match part.positions.iter().position(|p| !p.is_finite()) {
        Some(vertex) => Err(GlbError::Broken(format!(
            "mesh {mesh}, primitive {primitive}: vertex {} is not finite",
            vertices[vertex]
        ))),
        None => Ok(part),
    }
}

/// Takes off what stems have below the ground (`below` of a preset's `mesh`): one band of triangles, from the first ring of a
/// stem straight down, so that each has an edge that is plumb. A tree that kept it would stand on it.
fn unsink(part: &mut Part, below: f32, used: &mut Used) {
    let reach = 0.5 * below;
    let is_plumb = |[a, b]: [Vec3; 2]| {
        let (edge, low) = (a - b, a.y.min(b.y));
        low < -reach && edge.y.abs() > reach && edge.with_y(0.0).length() < 1e-3 * edge.y.abs()
    };
    let is_sunk = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|corner| part.positions[corner as usize]);
        [[a, b], [b, c], [c, a]].into_iter().any(is_plumb)
    };
    let sunk: Vec<bool> = part.triangles.iter().map(is_sunk).collect();
    if !sunk.contains(&true) {
        return;
    }
    let is_kept = || sunk.iter().map(|sunk| !sunk);
    retain(&mut part.faces, is_kept());
    retain(&mut part.triangles, is_kept());
    let mut is_used = vec![false; part.positions.len()];
    used.keep(&mut part.triangles).iter().for_each(|&vertex| is_used[vertex as usize] = true);
    let is_used = || is_used.iter().copied();
    retain(&mut part.positions, is_used());
    retain(&mut part.normals, is_used());
    retain(&mut part.uvs, is_used());
    retain(&mut part.colors, is_used());
}

/// Keeps those of the values that are told; none where there are none.
fn retain<T>(values: &mut Vec<T>, mut is_kept: impl Iterator<Item = bool>) {
    values.retain(|_| is_kept.next().unwrap_or(false));
}

/// Texture coordinates where the picture's transform takes them: scaled, turned, moved.
fn placed(uvs: Vec<[f32; 2]>, placing: Placing) -> Vec<Vec2> {
    let sound = |uv: Vec2| if uv.is_finite() { uv } else { Vec2::ZERO };
    let Some((offset, rotation, scale)) = placing.transform else {
        return uvs.into_iter().map(|uv| sound(Vec2::from_array(uv))).collect();
    };
    let (sin, cos) = math::sin_cos(rotation);
    let place = |[u, v]: [f32; 2]| {
        let (u, v) = (u * scale[0], v * scale[1]);
        sound(Vec2::new(cos * u + sin * v + offset[0], cos * v - sin * u + offset[1]))
    };
    uvs.into_iter().map(place).collect()
}

/// Colours of three numbers have no alpha; numbers that are none count as one.
fn opaque(mut colors: Vec<[f32; 4]>, components: usize) -> Vec<[f32; 4]> {
    for color in &mut colors {
        if components < 4 {
            color[3] = 1.0;
        }
        *color = color.map(|c| if c.is_finite() { c.clamp(0.0, 1.0) } else { 1.0 });
    }
    colors
}

/// Moves a part to where its node stands. One that is turned inside out by it is turned back.
fn place(part: &mut Part, instance: &Instance) {
    let m = &instance.matrix;
    let (x, y, z) = (Vec3::new(m[0], m[1], m[2]), Vec3::new(m[4], m[5], m[6]), Vec3::new(m[8], m[9], m[10]));
    for position in &mut part.positions {
        *position = Vec3::from_array(instance.place(position.to_array()));
    }
    let turned = x.cross(y).dot(z) < 0.0;
    for normal in &mut part.normals {
        // The adjoint carries normals, whatever the node's scale.
        let n = y.cross(z) * normal.x + z.cross(x) * normal.y + x.cross(y) * normal.z;
        *normal = n.normalize_or_zero() * if turned { -1.0 } else { 1.0 };
    }
    if turned {
        part.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
}
