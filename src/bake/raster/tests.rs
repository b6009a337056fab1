//! Tests of the rasterizer: exact pictures, edges that neither overlap nor gap, and broken input.

use glam::Vec2;

use super::*;
use crate::bake::Maps;
use crate::base::Seed;

fn flat(maps: [u8; 4]) -> Picture {
    Picture::new(&Maps {
        width: 4,
        height: 4,
        color: vec![maps; 16],
        normal: vec![[128, 128, 255]; 16],
        orm: vec![[255, 255, 0]; 16],
    })
}

fn quad(half: f32, z: f32) -> Mesh {
    Mesh {
        positions: [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| Vec3::new(x * half, y * half, z))
            .into(),
        normals: vec![Vec3::Z; 4],
        uvs: [(0.0, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, 0.0)].map(|(x, y)| Vec2::new(x, y)).into(),
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Mesh::default()
    }
}

fn front(half: f32) -> View {
    View::new(Frame::WORLD, Vec3::ZERO, half, half)
}

fn draw(meshes: &[(&Mesh, &Picture)], view: &View, size: u32, samples: u32) -> Target {
    let surfaces: Vec<Surface<'_>> = meshes
        .iter()
        .map(|(mesh, p)| Surface { mesh, pictures: std::slice::from_ref(*p), repeat: Repeat::Cutout, closed: false })
        .collect();
    rasterize(&surfaces, view, size, size, samples, &Shading::Albedo)
}

#[test]
fn a_square_of_half_the_width_covers_a_quarter_exactly() {
    let target = draw(&[(&quad(1.0, 0.0), &flat([255; 4]))], &front(2.0), 64, 3);
    assert_eq!(target.coverage.iter().sum::<f32>(), 1024.0);
    assert!((target.color[32 * 64 + 32] - Vec3::ONE).length() < 1e-4);
}

#[test]
fn the_nearer_one_shows_from_either_side_and_holes_show_what_is_behind() {
    let (red, blue, clear) = (flat([255, 0, 0, 255]), flat([0, 0, 255, 255]), flat([0, 255, 0, 100]));
    let (near, far) = (quad(1.0, 1.0), quad(1.0, 0.0));
    for order in [[(&near, &red), (&far, &blue)], [(&far, &blue), (&near, &red)]] {
        assert!(draw(&order, &front(2.0), 16, 1).color[8 * 16 + 8].x > 0.99);
    }
    let behind = View::level(std::f32::consts::PI, Vec3::ZERO, 2.0, 2.0);
    assert!(draw(&[(&near, &red), (&far, &blue)], &behind, 16, 1).color[8 * 16 + 8].z > 0.99);
    assert!(draw(&[(&near, &clear), (&far, &blue)], &front(2.0), 16, 1).color[8 * 16 + 8].z > 0.99);
    let slab = View { front: 0.5, ..front(2.0) };
    assert!(draw(&[(&near, &red), (&far, &blue)], &slab, 16, 1).color[8 * 16 + 8].z > 0.99);
}

#[test]
fn a_fan_of_random_triangles_leaves_no_gap_and_no_overlap() {
    // A grid with jittered inner vertices tiles the square: drawn with depth by index, every sample is covered, and
    // the areas of the single triangles add up to it.
    let n = 12_usize;
    let mut mesh = Mesh::default();
    for i in 0..=n {
        for j in 0..=n {
            let inner = i > 0 && i < n && j > 0 && j < n;
            let seed = Seed::new(3).at((i * 100 + j) as u64);
            let jitter = if inner { Vec2::new(seed.at(0).unit(), seed.at(1).unit()) * 0.6 - 0.3 } else { Vec2::ZERO };
            let p = (Vec2::new(i as f32, j as f32) + jitter) / n as f32 * 2.0 - 1.0;
            mesh.positions.push(p.extend(0.0));
        }
    }
    for i in 0..n {
        for j in 0..n {
            let at = |di: usize, dj: usize| ((i + di) * (n + 1) + j + dj) as u32;
            mesh.indices.extend([at(0, 0), at(1, 0), at(1, 1), at(0, 0), at(1, 1), at(0, 1)]);
        }
    }
    let white = flat([255; 4]);
    let whole = draw(&[(&mesh, &white)], &front(1.3), 97, 1).coverage.iter().sum::<f32>();
    let mut parts = 0.0;
    for triangle in mesh.indices.as_chunks::<3>().0 {
        let one = Mesh { indices: triangle.to_vec(), ..mesh.clone() };
        parts += draw(&[(&one, &white)], &front(1.3), 97, 1).coverage.iter().sum::<f32>();
    }
    assert_eq!(whole, parts);
    let square = draw(&[(&quad(1.0, 0.0), &white)], &front(1.3), 97, 1).coverage.iter().sum::<f32>();
    assert_eq!(whole, square);
}

#[test]
fn the_picture_is_the_same_on_one_thread_and_on_many() {
    let mut mesh = Mesh::default();
    for i in 0..3000_u64 {
        let seed = Seed::new(8).at(i);
        let base = seed.at(0).direction();
        for k in 0..3 {
            mesh.positions.push(base + seed.at(k + 1).direction() * 0.2);
            mesh.normals.push(base);
            mesh.uvs.push(Vec2::new(k as f32 * 0.5, seed.at(k).unit()));
            mesh.indices.push(mesh.indices.len() as u32);
        }
    }
    let green = flat([20, 90, 10, 255]);
    let shot = || draw(&[(&mesh, &green)], &front(1.2), 60, 3);
    let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    let one = pool(1).install(shot);
    assert_eq!(one, pool(4).install(shot));
    // Pixels show one triangle or several: their normals are units, and zero where nothing is seen.
    for (normal, covered) in one.normal.iter().zip(&one.coverage) {
        let length = if *covered > 0.0 { 1.0 } else { 0.0 };
        assert!((normal.length() - length).abs() < 1e-5, "{normal} where {covered} is covered");
    }
}

#[test]
fn broken_meshes_and_views_draw_nothing_and_never_panic() {
    let white = flat([255; 4]);
    let mut broken = quad(1.0, 0.0);
    broken.positions[2] = Vec3::new(f32::NAN, 0.0, 0.0);
    broken.indices.extend([0, 1, 99, 7]);
    broken.tiles = vec![5];
    assert_eq!(draw(&[(&broken, &white)], &front(2.0), 16, 1).coverage.iter().sum::<f32>(), 0.0);
    for half in [0.0, f32::NAN, f32::INFINITY, 1e-30] {
        let target = draw(&[(&quad(1e30, 0.0), &white)], &front(half), 16, 99);
        assert!(target.coverage.iter().all(|c| *c == 0.0));
    }
    assert_eq!(draw(&[], &front(1.0), 0, 0).coverage.len(), 1);
}

#[test]
fn what_is_seen_keeps_one_of_its_normals_where_others_take_the_mean() {
    // Strips a sample wide, of which one in four faces aside; the larger picture is drawn in bands.
    for size in [16_u32, 128] {
        let (mut mesh, strips) = (Mesh::default(), size * 4);
        for i in 0..strips {
            let first = mesh.positions.len() as u32;
            let [low, high] = [i, i + 1].map(|k| k as f32 / strips as f32 * 2.0 - 1.0);
            let corners = [(low, -1.0), (high, -1.0), (high, 1.0), (low, 1.0)];
            mesh.positions.extend(corners.map(|(x, y)| Vec3::new(x, y, 0.0)));
            mesh.normals.extend([if i % 4 == 0 { Vec3::X } else { Vec3::Z }; 4]);
            mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|k| first + k));
        }
        let drawn = |shading: Shading| {
            let surface = Surface { mesh: &mesh, pictures: &[], repeat: Repeat::Cutout, closed: false };
            rasterize(&[surface], &front(1.0), size, size, 4, &shading).normal
        };
        assert!(drawn(Shading::Albedo).iter().all(|n| n.x > 0.2 && n.x < 0.5));
        let seen = drawn(Shading::Seen);
        assert!(seen.iter().all(|n| *n == Vec3::X || *n == Vec3::Z));
        let aside = seen.iter().filter(|n| **n == Vec3::X).count() as f32 / seen.len() as f32;
        assert!((aside - 0.25).abs() < 0.08, "{size}: {aside}");
        let (upper, lower) = seen.split_at(seen.len() / 2);
        assert_ne!(upper, lower, "{size}: the pattern repeats");
    }
}
