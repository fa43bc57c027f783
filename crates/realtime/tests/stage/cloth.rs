//! A mesh that follows a cloth on the GPU shows what one shows that the processor deforms to where the cloth is.

use crate::device::{Gpu, gpu};
use glam::{Mat4, Vec2, Vec3};
use std::sync::Arc;
use yugen_motion::cloth::{Cloth, PRESETS, Settings, Sheet, SmallSteps, Step};
use yugen_realtime::{ClothPass, Options, Stage, StageError};
use yugen_reflectance::Kind;
use yugen_scene::prepared::{NONE, Rows, VertexRow};
use yugen_scene::{Camera, Geometry, Light, Mesh, ModelBuilder, Scene, Shape, look_along};

const CELLS: u32 = 16;

fn sheet() -> Sheet {
    Sheet::rectangle(Vec3::new(-0.5, 0.6, -0.5), Vec3::X, Vec3::Z, Vec2::ONE, [CELLS; 2])
}

/// A sheet that is held at two corners.
fn solver() -> SmallSteps {
    let cloth = Cloth::new(sheet(), &PRESETS[0].fabric).expect("a cloth");
    SmallSteps::new(cloth, &[0, CELLS], Settings::default()).expect("a solver")
}

/// The sheet as a mesh with one vertex that is not the cloth's, drawn twice, above a mirror with balls about it.
fn scene(tangents: bool) -> Scene {
    let sheet = sheet();
    let mut positions = sheet.positions;
    positions.push(Vec3::new(0.8, 0.9, -0.8));
    let last = positions.len() as u32 - 1;
    let triangles = [sheet.triangles, vec![[CELLS, last, CELLS - 1]]].concat();
    let normals = vec![Vec3::Y; positions.len()];
    let along = if tangents { vec![Vec3::X.extend(1.0); positions.len()] } else { Vec::new() };
    let mesh = Arc::new(Mesh { positions, triangles, normals, tangents: along, ..Mesh::default() });
    let model = |kind| ModelBuilder::new(kind).build().expect("a model");
    let beside = Mat4::from_translation(Vec3::new(1.3, 0.2, -0.4)) * Mat4::from_rotation_y(0.7);
    let beside = beside * Mat4::from_scale(Vec3::splat(0.7));
    let mut shapes = vec![
        Shape::new("sheet", Geometry::Mesh(mesh.clone()), Mat4::IDENTITY, 0),
        Shape::new("sheet beside it", Geometry::Mesh(mesh), beside, 0),
    ];
    let lying = Mat4::from_translation(Vec3::Y * -0.9) * Mat4::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    shapes.push(Shape::new("floor", Geometry::Rectangle, lying * Mat4::from_scale(Vec3::splat(3.0)), 1));
    for k in 0..5u32 {
        let (sin, cos) = (k as f32 * 1.2566).sin_cos();
        let at = Mat4::from_translation(Vec3::new(1.6 * sin, -0.6, 1.6 * cos));
        let ball = at * Mat4::from_scale(Vec3::splat(0.3));
        shapes.push(Shape::new(format!("ball {k}"), Geometry::Sphere, ball, 0));
    }
    Scene {
        materials: vec![model(Kind::Lambert), model(Kind::MetallicRoughness)],
        shapes,
        lights: vec![Light::Point { position: Vec3::new(1.0, 3.0, 2.0), intensity: Vec3::splat(30.0) }],
        ..Scene::default()
    }
}

fn camera() -> Camera {
    let eye = Vec3::new(0.5, 1.2, 4.5);
    crate::camera(look_along(eye, -eye, Vec3::Y), [64, 48])
}

fn stage(gpu: &Gpu, rows: &Rows, traced: bool) -> Stage {
    let options = Options { trace_camera: traced, ..Options::new([64, 48], Some(3)) };
    Stage::new(&gpu.device, &gpu.queue, rows, &options).expect("a stage")
}

fn picture(stage: &mut Stage) -> Vec<f32> {
    for _ in 0..4 {
        stage.frame(&camera()).expect("a frame");
    }
    stage.image().expect("a picture").data
}

#[test]
fn a_draped_mesh_is_shown_where_the_cloth_is() {
    let Some(gpu) = gpu() else { return };
    let mut rows = Rows::new(&scene(false)).expect("rows");
    let (mesh, first) = (rows.draws[0].mesh, rows.meshes[rows.draws[0].mesh as usize].first_vertex as usize);
    let count = rows.meshes[mesh as usize].vertices;
    let of: Vec<u32> = (0..count).map(|v| if v + 1 < count { v } else { NONE }).collect();
    for traced in [false, true] {
        let mut cloth = ClothPass::new(&gpu.device, &gpu.queue, &solver()).expect("a cloth");
        let [mut draped, mut deformed] = [0, 1].map(|_| stage(gpu, &rows, traced));
        draped.drape(mesh, &cloth, &of).expect("a drape");
        let before = picture(&mut draped);
        let held = [0, CELLS].map(|v| sheet().positions[v as usize]);
        for round in 0..2 {
            for _ in 0..25 {
                cloth.step(&Step { targets: &held, ..Step::default() });
            }
            draped.follow().expect("the device lives");
            let [positions, normals] = cloth.read_vertices().expect("the device lives");
            let lowest = positions.iter().map(|p| p.y).fold(f32::INFINITY, f32::min);
            assert!(lowest < 0.3, "it falls out of the boxes that it had: {lowest}");
            let mut vertices: Vec<VertexRow> = rows.vertices[first..first + count as usize].to_vec();
            for (vertex, (position, normal)) in vertices.iter_mut().zip(positions.iter().zip(&normals)) {
                (vertex.position, vertex.normal) = ((*position).into(), (*normal).into());
            }
            deformed.deform(mesh, &vertices).expect("a mesh");
            let (got, want) = (picture(&mut draped), picture(&mut deformed));
            assert!(got == want, "round {round}, traced {traced}: {} pixels differ", differ(&got, &want));
            assert!(differ(&got, &before) > 300, "nothing has moved");
            // A pose of all else leaves it where the cloth is, and what is above it in the tree of boxes.
            rows.pose(&scene(false)).expect("a pose");
            assert!(draped.pose(&rows).expect("the device lives"));
            assert!(picture(&mut draped) == want, "a pose moved it");
        }
    }
}

/// How many pixels are others.
fn differ(a: &[f32], b: &[f32]) -> usize {
    a.chunks_exact(3).zip(b.chunks_exact(3)).filter(|(a, b)| a != b).count()
}

#[test]
fn what_cannot_follow_is_refused() {
    let Some(gpu) = gpu() else { return };
    let cloth = ClothPass::new(&gpu.device, &gpu.queue, &solver()).expect("a cloth");
    let rows = Rows::new(&scene(false)).expect("rows");
    let mut plain = stage(gpu, &rows, false);
    let mesh = rows.draws[0].mesh;
    let count = rows.meshes[mesh as usize].vertices as usize;
    assert!(matches!(plain.drape(mesh, &cloth, &[0]), Err(StageError::Hierarchy(_))));
    assert!(matches!(plain.drape(99, &cloth, &[]), Err(StageError::Hierarchy(_))));
    let mut of = vec![0; count];
    of[7] = (CELLS + 1) * (CELLS + 1);
    assert!(matches!(plain.drape(mesh, &cloth, &of), Err(StageError::ClothVertex { vertex: 7, .. })));
    let rows = Rows::new(&scene(true)).expect("rows");
    let refused = stage(gpu, &rows, false).drape(rows.draws[0].mesh, &cloth, &vec![0; count]);
    assert!(matches!(refused, Err(StageError::ClothTangents { .. })));
}
