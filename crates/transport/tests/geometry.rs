//! The local geometry of every shape against Mitsuba 3.9.1, and what light sampling promises.

use glam::{Affine3A, Mat4, Vec2, Vec3};
use std::sync::Arc;
use yugen_optics::random::Pcg32;
use yugen_scene::prepared::GeometryError;
use yugen_scene::{Geometry as Form, Mesh, Scene, Shape};
use yugen_transport::accel::{NO_INSTANCE, Ray};
use yugen_transport::geometry::{Geometry, ShapeSampler};

fn shape(geometry: Form, to_world: Mat4) -> Shape {
    Shape::new("thing", geometry, to_world, 0)
}

fn scene(shapes: Vec<Shape>) -> Scene {
    Scene { shapes, ..Default::default() }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    Similar,
    Stretched,
    Mirrored,
    MirroredSimilar,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum What {
    Sphere,
    Rectangle,
    Disc,
    Cylinder,
    /// With texture coordinates and normals.
    MeshUv,
    /// With normals.
    Mesh,
    /// With normals that `face_normals` drops.
    MeshFace,
}

impl Place {
    fn matrix(self) -> Mat4 {
        let scale = match self {
            Self::Similar => Vec3::splat(1.5),
            Self::Stretched => Vec3::new(1.5, 0.7, 1.2),
            Self::Mirrored => Vec3::new(1.5, -0.7, 1.2),
            Self::MirroredSimilar => Vec3::new(1.5, -1.5, 1.5),
        };
        Mat4::from_translation(Vec3::new(0.3, -0.2, 0.5))
            * Mat4::from_axis_angle(Vec3::new(1.0, 2.0, 3.0).normalize(), 40f32.to_radians())
            * Mat4::from_scale(scale)
    }
}

fn one_triangle(what: What) -> Mesh {
    Mesh {
        positions: vec![Vec3::ZERO, Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.5)],
        normals: vec![Vec3::Z, Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.6, 0.8)],
        uvs: if what == What::MeshUv {
            vec![Vec2::new(0.1, 0.8), Vec2::new(0.9, 0.9), Vec2::new(0.3, 0.2)]
        } else {
            vec![]
        },
        triangles: vec![[0, 1, 2]],
        ..Default::default()
    }
}

struct Row {
    place: Place,
    flip: bool,
    what: What,
    ray: Ray,
    expected: [Vec3; 5],
    uv: Vec2,
}

#[rustfmt::skip]
#[allow(clippy::too_many_arguments)]
fn row(place: Place, flip: bool, what: What, o: [f32; 3], d: [f32; 3], t: [f32; 1], p: [f32; 3], uv: [f32; 2], n: [f32; 3], s: [f32; 3], dp_du: [f32; 3], dp_dv: [f32; 3]) -> Row {
    assert!((t[0] - 1.0).abs() < 1e-6, "the rays are made to meet at one");
    Row { place, flip, what, ray: Ray::new(o.into(), d.into()), expected: [p, n, s, dp_du, dp_dv].map(Vec3::from), uv: uv.into() }
}

/// Mitsuba 3.9.1, scalar_rgb, `Scene.ray_intersect`: ray, t, position, (u, v), shading normal, shading
/// tangent, ∂p/∂u, ∂p/∂v. Its stretched spheres are refused, so there are none.
#[rustfmt::skip]
fn table() -> Vec<Row> {
    vec![
    row(Place::Similar, false, What::Sphere, [1.946782, 2.557425, 4.01779], [-1.09864, -1.947224, -2.380638], [0.9999999], [0.8481421, 0.6102008, 1.637152], [0.1475837, 0.2048328], [0.3654281, 0.5401339, 0.7581015], [-0.9153771, 0.06069426, 0.3979962], [-5.176336, 0.343218, 2.250616], [-0.7961998, 3.955522, -2.434446]),
    row(Place::Similar, false, What::Rectangle, [2.124922, -0.3405284, 3.060378], [-1.183509, -0.1122455, -2.855667], [1.0], [0.9414125, -0.4527738, 0.2047117], [0.65, 0.3], [0.3937178, -0.07152554, 0.9164444], [0.7827556, 0.5487989, -0.2934511], [2.348267, 1.646397, -0.8803532], [-1.445863, 2.498667, 0.8161767]),
    row(Place::Similar, false, What::Disc, [2.124922, -0.3405284, 3.060378], [-1.183509, -0.1122455, -2.855667], [1.0], [0.9414127, -0.4527739, 0.2047117], [0.5000001, 0.8524163], [0.3937178, -0.07152554, 0.9164445], [0.8552169, -0.3370319, -0.3937177], [1.282825, -0.5055478, -0.5905766], [1.588225, 4.423862, -0.3370563]),
    row(Place::Similar, false, What::Cylinder, [4.505178, -1.454194, -0.3405966], [-2.568007, 0.6842735, 1.07482], [1.0], [1.937171, -0.7699208, 0.7342235], [0.8524163, 0.6], [0.8552169, -0.3370318, -0.3937178], [0.3370318, 0.9387725, -0.07152553], [3.176449, 8.847719, -0.6741121], [0.5905766, -0.1072883, 1.374667]),
    row(Place::Similar, false, What::MeshUv, [2.670953, 0.7015759, 4.421132], [-1.890797, -0.1910545, -3.867364], [0.9999999], [0.7801558, 0.5105214, 0.5537671], [0.35, 0.675], [0.4320131, 0.1545215, 0.8885313], [0.6786093, 0.5932152, -0.433111], [2.732392, 2.214814, -0.8373398], [1.623536, -1.254544, -2.104816]),
    row(Place::Similar, false, What::Mesh, [2.670953, 0.7015759, 4.421132], [-1.890797, -0.1910545, -3.867364], [0.9999999], [0.7801558, 0.5105214, 0.5537671], [0.25, 0.25], [0.4320131, 0.1545215, 0.8885313], [0.7222403, 0.5307625, -0.4434639], [2.348267, 1.646397, -0.8803532], [-0.4276433, 1.195689, 1.095422]),
    row(Place::Similar, false, What::MeshFace, [2.670953, 0.7015759, 4.421132], [-1.890797, -0.1910545, -3.867364], [0.9999999], [0.7801558, 0.5105214, 0.5537671], [0.25, 0.25], [0.5676885, -0.4364536, 0.6980245], [0.7827556, 0.5487989, -0.2934511], [2.348267, 1.646397, -0.8803532], [-0.4276433, 1.195689, 1.095422]),
    row(Place::Similar, true, What::Sphere, [1.946782, 2.557425, 4.01779], [-1.09864, -1.947224, -2.380638], [0.9999999], [0.8481421, 0.6102008, 1.637152], [0.1475837, 0.2048328], [-0.3654281, -0.5401339, -0.7581015], [-0.9153771, 0.06069426, 0.3979962], [-5.176336, 0.343218, 2.250616], [-0.7961998, 3.955522, -2.434446]),
    row(Place::Similar, true, What::Rectangle, [2.124922, -0.3405284, 3.060378], [-1.183509, -0.1122455, -2.855667], [1.0], [0.9414125, -0.4527738, 0.2047117], [0.65, 0.3], [-0.3937178, 0.07152554, -0.9164444], [0.7827556, 0.5487989, -0.2934511], [2.348267, 1.646397, -0.8803532], [-1.445863, 2.498667, 0.8161767]),
    row(Place::Similar, true, What::Disc, [2.124922, -0.3405284, 3.060378], [-1.183509, -0.1122455, -2.855667], [1.0], [0.9414127, -0.4527739, 0.2047117], [0.4999999, 0.8524163], [-0.3937178, 0.07152554, -0.9164445], [0.8552169, -0.3370319, -0.3937177], [1.282825, -0.5055478, -0.5905766], [1.588225, 4.423861, -0.3370562]),
    row(Place::Similar, true, What::Cylinder, [4.505178, -1.454194, -0.3405966], [-2.568007, 0.6842735, 1.07482], [1.0], [1.937171, -0.7699208, 0.7342235], [0.8524163, 0.6], [-0.8552169, 0.3370318, 0.3937178], [0.3370318, 0.9387725, -0.07152553], [3.176449, 8.847719, -0.6741121], [0.5905766, -0.1072883, 1.374667]),
    row(Place::Similar, true, What::MeshUv, [2.670953, 0.7015759, 4.421132], [-1.890797, -0.1910545, -3.867364], [0.9999999], [0.7801558, 0.5105214, 0.5537671], [0.35, 0.675], [-0.4320131, -0.1545215, -0.8885313], [0.6786093, 0.5932152, -0.433111], [2.732392, 2.214814, -0.8373398], [1.623536, -1.254544, -2.104816]),
    row(Place::Similar, true, What::Mesh, [2.670953, 0.7015759, 4.421132], [-1.890797, -0.1910545, -3.867364], [0.9999999], [0.7801558, 0.5105214, 0.5537671], [0.25, 0.25], [-0.4320131, -0.1545215, -0.8885313], [0.7222403, 0.5307625, -0.4434639], [2.348267, 1.646397, -0.8803532], [-0.4276433, 1.195689, 1.095422]),
    row(Place::Similar, true, What::MeshFace, [2.670953, 0.7015759, 4.421132], [-1.890797, -0.1910545, -3.867364], [0.9999999], [0.7801558, 0.5105214, 0.5537671], [0.25, 0.25], [-0.5676885, 0.4364536, -0.6980245], [0.7827556, 0.5487989, -0.2934511], [2.348267, 1.646397, -0.8803532], [-0.4276433, 1.195689, 1.095422]),
    row(Place::Stretched, false, What::Rectangle, [1.805673, -0.1632779, 2.540295], [-1.018485, -0.02297145, -2.248524], [1.0], [0.7871873, -0.1862494, 0.2917705], [0.65, 0.3], [0.3937178, -0.07152554, 0.9164445], [0.7827556, 0.5487989, -0.2934511], [2.348267, 1.646397, -0.8803532], [-0.674736, 1.166044, 0.3808825]),
    row(Place::Stretched, false, What::Disc, [1.805673, -0.1632779, 2.540295], [-1.018485, -0.02297145, -2.248524], [1.0], [0.7871873, -0.1862494, 0.2917705], [0.5, 0.8524163], [0.3937177, -0.07152553, 0.9164444], [0.9192212, 0.02594457, -0.3928858], [0.9743745, 0.02750124, -0.416459], [2.314995, 3.167894, -0.7473114]),
    row(Place::Stretched, false, What::Cylinder, [3.580163, 0.02563787, -0.04047946], [-2.022311, -0.249635, 0.7838606], [0.9999999], [1.557851, -0.2239971, 0.7433811], [0.8524163, 0.6], [0.7134804, -0.6048331, -0.3537267], [0.5795964, 0.7931336, -0.1871014], [4.62999, 6.335789, -1.494622], [0.4724613, -0.08583064, 1.099733]),
    row(Place::Stretched, false, What::MeshUv, [2.493063, 0.4655725, 3.505264], [-1.631281, -0.1189466, -3.040276], [0.9999999], [0.8617823, 0.3466259, 0.4649887], [0.35, 0.675], [0.3861678, 0.1922422, 0.9021737], [0.7174409, 0.5521466, -0.4247502], [2.797693, 2.083698, -0.9083625], [1.101127, -0.2056124, -1.536634]),
    row(Place::Stretched, false, What::Mesh, [2.493063, 0.4655725, 3.505264], [-1.631281, -0.1189466, -3.040276], [0.9999999], [0.8617823, 0.3466259, 0.4649887], [0.25, 0.25], [0.3861678, 0.1922422, 0.9021737], [0.7350788, 0.5267176, -0.4268813], [2.348267, 1.646397, -0.8803532], [-0.1011374, 0.540107, 0.7403079]),
    row(Place::Stretched, false, What::MeshFace, [2.493063, 0.4655725, 3.505264], [-1.631281, -0.1189466, -3.040276], [0.9999999], [0.8617823, 0.3466259, 0.4649887], [0.25, 0.25], [0.6125846, -0.5963432, 0.5187629], [0.7827556, 0.5487989, -0.2934511], [2.348267, 1.646397, -0.8803532], [-0.1011374, 0.540107, 0.7403079]),
    row(Place::Mirrored, false, What::Rectangle, [1.670725, 0.06993096, 2.616471], [-1.153433, 0.2102374, -2.172348], [0.9999999], [0.5172929, 0.2801684, 0.4441234], [0.65, 0.3000001], [0.3937178, -0.07152554, 0.9164445], [0.7827556, 0.5487989, -0.2934511], [2.348267, 1.646397, -0.8803533], [0.6747361, -1.166045, -0.3808824]),
    row(Place::Mirrored, false, What::Disc, [1.670725, 0.06993096, 2.616471], [-1.153433, 0.2102374, -2.172348], [1.0], [0.5172929, 0.2801684, 0.4441235], [0.5000001, 0.8524163], [0.3937177, -0.07152553, 0.9164444], [0.4099864, 0.9059781, -0.1054274], [0.4345856, 0.9603369, -0.111753], [3.586844, 0.9699521, -1.465258]),
    row(Place::Mirrored, false, What::Cylinder, [2.095743, 2.590936, 0.7974619], [-1.077681, -1.882097, 0.2506253], [1.0], [1.018062, 0.7088386, 1.048087], [0.8524163, 0.6], [-0.1963132, 0.967425, 0.1598434], [0.8980241, 0.2428433, -0.366851], [7.173687, 1.939905, -2.930516], [0.4724613, -0.08583064, 1.099733]),
    row(Place::Mirrored, false, What::MeshUv, [2.796695, -0.05914751, 3.333867], [-1.766228, 0.1142623, -2.964099], [1.0], [1.030466, 0.05511476, 0.3697681], [0.35, 0.6750001], [0.5976932, -0.1733052, 0.7827695], [0.7160392, 0.5545689, -0.423959], [2.93264, 1.850489, -0.9845389], [0.0215488, 1.660059, -0.9272223]),
    row(Place::Mirrored, false, What::Mesh, [2.796695, -0.05914751, 3.333867], [-1.766228, 0.1142623, -2.964099], [1.0], [1.030466, 0.05511476, 0.3697681], [0.25, 0.2499999], [0.5976932, -0.1733052, 0.7827695], [0.7045093, 0.5795463, -0.4096252], [2.348267, 1.646397, -0.8803532], [0.5735987, -0.6259376, 0.3594255]),
    row(Place::Mirrored, false, What::MeshFace, [2.796695, -0.05914751, 3.333867], [-1.766228, 0.1142623, -2.964099], [1.0], [1.030466, 0.05511476, 0.3697681], [0.25, 0.2499999], [0.01471905, -0.4877307, -0.8728701], [0.7827556, 0.5487989, -0.2934511], [2.348267, 1.646397, -0.8803532], [0.5735987, -0.6259376, 0.3594255]),
    row(Place::Mirrored, true, What::Rectangle, [1.670725, 0.06993096, 2.616471], [-1.153433, 0.2102374, -2.172348], [0.9999999], [0.5172929, 0.2801684, 0.4441234], [0.65, 0.3000001], [-0.3937178, 0.07152554, -0.9164445], [0.7827556, 0.5487989, -0.2934511], [2.348267, 1.646397, -0.8803533], [0.6747361, -1.166045, -0.3808824]),
    row(Place::Mirrored, true, What::Disc, [1.670725, 0.06993096, 2.616471], [-1.153433, 0.2102374, -2.172348], [1.0], [0.5172929, 0.2801684, 0.4441235], [0.4999999, 0.8524164], [-0.3937178, 0.07152554, -0.9164445], [0.4099866, 0.905978, -0.1054275], [0.4345859, 0.9603369, -0.1117531], [3.586842, 0.9699509, -1.465257]),
    row(Place::Mirrored, true, What::Cylinder, [2.095743, 2.590936, 0.7974619], [-1.077681, -1.882097, 0.2506253], [1.0], [1.018062, 0.7088386, 1.048087], [0.8524163, 0.6], [0.1963132, -0.967425, -0.1598434], [0.8980241, 0.2428433, -0.366851], [7.173687, 1.939905, -2.930516], [0.4724613, -0.08583064, 1.099733]),
    row(Place::Mirrored, true, What::MeshUv, [2.796695, -0.05914751, 3.333867], [-1.766228, 0.1142623, -2.964099], [1.0], [1.030466, 0.05511476, 0.3697681], [0.35, 0.6750001], [-0.5976932, 0.1733052, -0.7827695], [0.7160392, 0.5545689, -0.423959], [2.93264, 1.850489, -0.9845389], [0.0215488, 1.660059, -0.9272223]),
    row(Place::Mirrored, true, What::Mesh, [2.796695, -0.05914751, 3.333867], [-1.766228, 0.1142623, -2.964099], [1.0], [1.030466, 0.05511476, 0.3697681], [0.25, 0.2499999], [-0.5976932, 0.1733052, -0.7827695], [0.7045093, 0.5795463, -0.4096252], [2.348267, 1.646397, -0.8803532], [0.5735987, -0.6259376, 0.3594255]),
    row(Place::Mirrored, true, What::MeshFace, [2.796695, -0.05914751, 3.333867], [-1.766228, 0.1142623, -2.964099], [1.0], [1.030466, 0.05511476, 0.3697681], [0.25, 0.2499999], [-0.01471905, 0.4877307, 0.8728701], [0.7827556, 0.5487989, -0.2934511], [2.348267, 1.646397, -0.8803532], [0.5735987, -0.6259376, 0.3594255]),
    row(Place::MirroredSimilar, false, What::Sphere, [4.317998, -1.540389, 2.67926], [-2.775841, 0.9512298, -1.433873], [1.0], [1.542156, -0.5891591, 1.245387], [0.1475837, 0.2048327], [-0.8281043, 0.2594394, -0.4969249], [-0.3370317, -0.9387725, 0.07152549], [-1.905869, -5.308632, 0.404467], [2.110881, -1.068346, -4.075466]),
    row(Place::MirroredSimilar, false, What::Rectangle, [1.835749, 0.159205, 3.223614], [-1.472682, 0.3874878, -2.692431], [0.9999999], [0.3630674, 0.5466928, 0.5311823], [0.65, 0.3], [0.3937178, -0.07152554, 0.9164444], [0.7827556, 0.5487989, -0.2934511], [2.348267, 1.646397, -0.8803532], [1.445863, -2.498667, -0.8161767]),
    row(Place::MirroredSimilar, false, What::Disc, [1.835749, 0.159205, 3.223614], [-1.472682, 0.3874878, -2.692431], [1.0], [0.3630674, 0.5466928, 0.5311823], [0.5000001, 0.8524163], [0.3937178, -0.07152554, 0.9164445], [0.08408982, 0.9955904, 0.04157643], [0.1261347, 1.493386, 0.06236467], [4.313613, -0.2860152, -1.875513]),
    row(Place::MirroredSimilar, false, What::Cylinder, [1.324278, 4.042873, 1.454992], [-0.5437978, -2.81386, -0.06782746], [0.9999999], [0.7804807, 1.229013, 1.387165], [0.8524163, 0.6], [0.08408982, 0.9955904, 0.04157642], [0.9153771, -0.06069428, -0.3979962], [8.627227, -0.5720301, -3.751026], [0.5905766, -0.1072883, 1.374667]),
    row(Place::MirroredSimilar, false, What::MeshUv, [3.321591, -0.4228241, 4.053852], [-2.17997, 0.3086788, -3.704129], [0.9999999], [1.141621, -0.1141452, 0.3497229], [0.35, 0.675], [0.5883797, -0.1157033, 0.8002637], [0.7260258, 0.5112724, -0.4598771], [3.021564, 1.715081, -1.000575], [-0.6898451, 2.743323, -0.7989334]),
    row(Place::MirroredSimilar, false, What::Mesh, [3.321591, -0.4228241, 4.053852], [-2.17997, 0.3086788, -3.704129], [0.9999999], [1.141621, -0.1141452, 0.3497229], [0.25, 0.25], [0.5883797, -0.1157033, 0.8002637], [0.6965338, 0.5751871, -0.4289527], [2.348267, 1.646397, -0.8803532], [1.01822, -1.302978, 0.279245]),
    row(Place::MirroredSimilar, false, What::MeshFace, [3.321591, -0.4228241, 4.053852], [-2.17997, 0.3086788, -3.704129], [0.9999999], [1.141621, -0.1141452, 0.3497229], [0.25, 0.25], [-0.1366153, -0.3085048, -0.9413614], [0.7827556, 0.5487989, -0.2934511], [2.348267, 1.646397, -0.8803532], [1.01822, -1.302978, 0.279245]),
    row(Place::MirroredSimilar, true, What::Sphere, [4.317998, -1.540389, 2.67926], [-2.775841, 0.9512298, -1.433873], [1.0], [1.542156, -0.5891591, 1.245387], [0.1475837, 0.2048327], [0.8281043, -0.2594394, 0.4969249], [-0.3370317, -0.9387725, 0.07152549], [-1.905869, -5.308632, 0.404467], [2.110881, -1.068346, -4.075466]),
    ]
}

#[test]
fn local_geometry_equals_mitsuba() {
    for row in table() {
        let form = match row.what {
            What::Sphere => Form::Sphere,
            What::Rectangle => Form::Rectangle,
            What::Disc => Form::Disc,
            What::Cylinder => Form::Cylinder,
            what => Form::Mesh(Arc::new(one_triangle(what))),
        };
        let shape = Shape {
            flip_normals: row.flip,
            face_normals: row.what == What::MeshFace,
            ..shape(form, row.place.matrix())
        };
        let geometry = Geometry::build(&scene(vec![shape])).unwrap();
        let hit = geometry.intersect(&row.ray).unwrap();
        let s = geometry.surface(&row.ray, &hit);
        let title = format!("{:?} {:?} flip {}", row.what, row.place, row.flip);
        // Single precision on both sides; worst seen 1.2e-6 (in ∂p/∂v of a disc, 4.4 long).
        let found = [s.position, s.frame.n, s.frame.s, s.dp_du, s.dp_dv];
        for (found, expected) in found.into_iter().zip(row.expected) {
            assert!((found - expected).length() < 5e-6, "{title}: {found} {expected}");
        }
        assert!((s.uv - row.uv).length() < 1e-6, "{title}: uv {} {}", s.uv, row.uv);
        assert!((hit.t - 1.0).abs() < 1e-6, "{title}");
        // Ours, not Mitsuba's: both normals are on one side.
        assert!(s.geometric_normal.dot(s.frame.n) > 0.3, "{title}");
        assert!((s.geometric_normal.length() - 1.0).abs() < 1e-6);
        assert!(
            s.geometric_normal.dot(s.dp_du).abs() < 1e-5 && s.geometric_normal.dot(s.dp_dv).abs() < 1e-5,
            "{title}"
        );
    }
}

fn random_mesh(count: u32, seed: u64) -> Mesh {
    let mut rng = Pcg32::new(seed, 1);
    let mut mesh = Mesh::default();
    for i in 0..count {
        let c = rng.next_vec3() * 2.0 - 1.0;
        for _ in 0..3 {
            mesh.positions.push(c + 0.3 * (rng.next_vec3() - 0.5));
            mesh.normals.push((rng.next_vec3() - 0.5).normalize());
            mesh.uvs.push(Vec2::new(rng.next_f32(), rng.next_f32()));
        }
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh.attributes.push(("vertex_grey".into(), 1, mesh.positions.iter().map(|p| p.x).collect()));
    mesh.attributes.push((
        "vertex_color".into(),
        3,
        mesh.positions.iter().flat_map(|p| p.to_array()).collect(),
    ));
    mesh
}

fn random_ray(rng: &mut Pcg32) -> Ray {
    let origin = rng.next_vec3() * 6.0 - 3.0;
    let to = rng.next_vec3() * 2.0 - 1.0;
    Ray::new(origin, to - origin)
}

#[test]
fn an_instance_equals_its_flattened_copy() {
    let mesh = Arc::new(random_mesh(200, 4));
    let inner = vec![
        shape(Form::Mesh(mesh), Mat4::from_rotation_y(0.4)),
        shape(Form::Sphere, Mat4::from_translation(Vec3::X) * Mat4::from_scale(Vec3::splat(0.4))),
        Shape { flip_normals: true, ..shape(Form::Cylinder, Mat4::from_scale(Vec3::new(0.3, 0.2, 0.5))) },
    ];
    let places = [Place::Similar.matrix(), Place::Mirrored.matrix() * Mat4::from_translation(Vec3::Y)];
    let instanced = Scene {
        shapes: places.iter().map(|&m| shape(Form::Instance(0), m)).collect(),
        groups: vec![inner.clone()],
        ..Default::default()
    };
    // A sphere mirrored within a mirrored instance is turned by the sphere's own transform only.
    let flat = scene(
        places
            .iter()
            .flat_map(|&m| {
                inner.iter().map(move |s| {
                    let sphere = matches!(s.geometry, Form::Sphere) && m.determinant() < 0.0;
                    Shape { to_world: m * s.to_world, flip_normals: s.flip_normals ^ sphere, ..s.clone() }
                })
            })
            .collect(),
    );
    let (a, b) = (Geometry::build(&instanced).unwrap(), Geometry::build(&flat).unwrap());
    a.validate().unwrap();
    b.validate().unwrap();
    let mut rng = Pcg32::new(1, 1);
    let mut met = [0; 3];
    for _ in 0..20_000 {
        let ray = random_ray(&mut rng);
        let (x, y) = (a.intersect(&ray), b.intersect(&ray));
        assert_eq!((x.is_some(), a.occluded(&ray)), (y.is_some(), b.occluded(&ray)), "{ray:?}");
        let (Some(x), Some(y)) = (x, y) else { continue };
        assert_eq!(y.instance, NO_INSTANCE);
        assert_eq!((x.instance * 3 + x.shape, x.primitive), (y.shape, y.primitive));
        met[x.shape as usize] += 1;
        let (sx, sy) = (a.surface(&ray, &x), b.surface(&ray, &y));
        // One rounding more on the way; worst seen 2.3e-6, at grazing hits.
        // One rounding more on the way, which moves a point by more the flatter the ray; worst seen 4e-7
        // and 3e-6.
        let graze = sx.geometric_normal.dot(ray.dir.normalize()).abs();
        assert!((sx.position - sy.position).length() * graze < 3e-6);
        assert!((sx.geometric_normal - sy.geometric_normal).length() * graze < 1e-5);
        if x.shape != 0 {
            assert!((sx.frame.n - sy.frame.n).length() * graze < 1e-5);
            assert!((sx.dp_du - sy.dp_du).length() * graze < 1e-5);
        }
    }
    assert!(met.iter().all(|&n| n > 300), "{met:?}");
}

#[test]
fn attributes_are_interpolated() {
    let geometry =
        Geometry::build(&scene(vec![shape(Form::Mesh(Arc::new(random_mesh(50, 8))), Mat4::IDENTITY)]))
            .unwrap();
    let mut rng = Pcg32::new(6, 1);
    let mut met = 0;
    for _ in 0..10_000 {
        let ray = random_ray(&mut rng);
        let Some(hit) = geometry.intersect(&ray) else { continue };
        met += 1;
        let s = geometry.surface(&ray, &hit);
        assert!((s.position - ray.at(hit.t)).length() < 1e-5);
        assert!((geometry.attribute(&s, "vertex_color").unwrap() - s.position).length() < 1e-6);
        assert!((geometry.attribute(&s, "vertex_grey").unwrap() - s.position.x).length() < 1e-6);
        assert_eq!(geometry.attribute(&s, "vertex_nothing"), None);
    }
    assert!(met > 200);
}

#[test]
fn rays_do_not_meet_where_they_start() {
    let mut rng = Pcg32::new(12, 1);
    let far = Mat4::from_translation(Vec3::new(1000.0, -300.0, 20.0));
    let small = Mat4::from_scale(Vec3::splat(1e-3));
    let large = Mat4::from_scale(Vec3::splat(5e3));
    for place in [Mat4::IDENTITY, Place::Stretched.matrix(), far, small, large, far * large] {
        for form in [
            Form::Mesh(Arc::new(one_triangle(What::Mesh))),
            Form::Sphere,
            Form::Rectangle,
            Form::Disc,
            Form::Cylinder,
        ] {
            for instanced in [false, true] {
                let scene = if instanced {
                    let group = vec![vec![shape(form.clone(), Mat4::from_rotation_x(0.3))]];
                    Scene {
                        shapes: vec![shape(Form::Instance(0), place)],
                        groups: group,
                        ..Default::default()
                    }
                } else {
                    scene(vec![shape(form.clone(), place)])
                };
                let geometry = Geometry::build(&scene).unwrap();
                let mut bounds = geometry.bounds();
                let size = (bounds.hi - bounds.lo).max_element();
                bounds.hi = bounds.hi.max(bounds.lo + 0.3 * size);
                let mut starts = 0;
                for _ in 0..4000 {
                    let target = bounds.lo + (bounds.hi - bounds.lo) * rng.next_vec3();
                    let origin = bounds.lo + (bounds.hi - bounds.lo) * (rng.next_vec3() * 5.0 - 2.0);
                    let ray = Ray::new(origin, (target - origin).normalize_or(Vec3::Z));
                    let Some(hit) = geometry.intersect(&ray) else { continue };
                    let s = geometry.surface(&ray, &hit);
                    let n = s.geometric_normal;
                    // From steep to grazing: the sine of the elevation falls to 1e-4.
                    let side = if rng.next_f32() < 0.5 { n } else { -n };
                    let flat = yugen_optics::Frame::from_normal(n).to_world(yugen_optics::frame::spherical(
                        std::f32::consts::FRAC_PI_2,
                        rng.next_f32() * std::f32::consts::TAU,
                    ));
                    let up = 10f32.powf(-4.0 * rng.next_f32());
                    let out = (flat * (1.0 - up * up).sqrt() + side * up).normalize();
                    // Inside, the round ones are met again, on the other side.
                    if matches!(form, Form::Sphere | Form::Cylinder) && (side - n).length() > 1.0 {
                        continue;
                    }
                    starts += 1;
                    let next = s.spawn(out);
                    assert!(
                        !geometry.occluded(&next),
                        "{form:?} {place} {instanced}: {:?}",
                        geometry.intersect(&next)
                    );
                    // The step is small beside what it stands on.
                    assert!(
                        (next.origin - s.position).length()
                            < 2e-5 * (bounds.lo.abs().max(bounds.hi.abs())).max_element()
                    );
                }
                assert!(starts > 100, "{form:?}: {starts}");
            }
        }
    }
}

#[test]
fn bad_shapes_are_refused() {
    let build = |s: Shape| Geometry::build(&scene(vec![s])).map(|_| ());
    let name = || "thing".to_string();
    let mesh = |f: fn(&mut Mesh)| {
        let mut m = one_triangle(What::MeshUv);
        f(&mut m);
        shape(Form::Mesh(Arc::new(m)), Mat4::IDENTITY)
    };
    assert_eq!(
        build(mesh(|m| m.positions[1].y = f32::NAN)),
        Err(GeometryError::Vertex { shape: name(), index: 1 })
    );
    assert_eq!(
        build(mesh(|m| m.triangles.push([0, 1, 3]))),
        Err(GeometryError::Index { shape: name(), triangle: 1, index: 3, count: 3 })
    );
    assert!(matches!(
        build(mesh(|m| m.normals.truncate(2))),
        Err(GeometryError::Count { found: 2, count: 3, .. })
    ));
    assert!(matches!(
        build(mesh(|m| m.attributes.push(("a".into(), 2, vec![0.0; 6])))),
        Err(GeometryError::Count { .. })
    ));
    assert!(matches!(
        build(mesh(|m| m.attributes.push(("a".into(), 3, vec![0.0; 8])))),
        Err(GeometryError::Count { .. })
    ));
    let overflow = Shape { to_world: Mat4::from_scale(Vec3::splat(3e38)), ..mesh(|_| {}) };
    assert_eq!(build(overflow), Err(GeometryError::Vertex { shape: name(), index: 1 }));
    let nan = Shape { to_world: Mat4::NAN, ..mesh(|_| {}) };
    assert_eq!(build(nan), Err(GeometryError::Transform { shape: name() }));
    let flat = shape(Form::Sphere, Mat4::from_scale(Vec3::new(1.0, 0.0, 1.0)));
    assert_eq!(build(flat), Err(GeometryError::Transform { shape: name() }));
    assert_eq!(
        build(shape(Form::Instance(3), Mat4::IDENTITY)),
        Err(GeometryError::Group { shape: name(), group: 3, count: 0 })
    );
    let nested = Scene { groups: vec![vec![shape(Form::Instance(0), Mat4::IDENTITY)]], ..Default::default() };
    assert_eq!(Geometry::build(&nested).map(|_| ()), Err(GeometryError::Nested { shape: name() }));

    // Nothing at all, and an instance of nothing, are no errors.
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    let nothing = Scene {
        shapes: vec![shape(Form::Instance(0), Mat4::IDENTITY)],
        groups: vec![vec![]],
        ..Default::default()
    };
    for s in [Scene::default(), nothing] {
        let geometry = Geometry::build(&s).unwrap();
        assert!(
            !geometry.occluded(&ray) && geometry.intersect(&ray).is_none() && geometry.bounds().is_empty()
        );
    }
}

#[test]
fn normals_are_safe_on_bad_meshes() {
    // A triangle without area is not met; opposite vertex normals that cancel fall back on the geometric one.
    let mut mesh = one_triangle(What::MeshUv);
    mesh.normals = vec![Vec3::Z, -Vec3::Z, Vec3::ZERO];
    mesh.uvs = vec![Vec2::ZERO; 3];
    mesh.triangles.push([0, 0, 1]);
    let geometry = Geometry::build(&scene(vec![shape(Form::Mesh(Arc::new(mesh)), Mat4::IDENTITY)])).unwrap();
    assert_eq!(geometry.stats().triangles, 1);
    let ray = Ray::new(Vec3::new(0.75, 0.25, 3.0), -Vec3::Z);
    let s = geometry.surface(&ray, &geometry.intersect(&ray).unwrap());
    assert!(s.frame.n.is_finite() && (s.frame.n.length() - 1.0).abs() < 1e-6);
    assert!(s.frame.s.is_finite() && s.dp_du.is_finite());
}

/// Shapes that emit, and a point from which to see them.
fn lights() -> Vec<(&'static str, Shape, Vec3)> {
    let quad = |skew: f32, order: [[u32; 3]; 2]| {
        Form::Mesh(Arc::new(Mesh {
            positions: vec![
                Vec3::ZERO,
                Vec3::new(2.0, 0.0, 0.0),
                Vec3::new(2.0 + skew, 1.0, 0.0),
                Vec3::new(skew, 1.0, 0.0),
            ],
            triangles: order.to_vec(),
            ..Default::default()
        }))
    };
    let place = Place::Stretched.matrix();
    vec![
        ("sphere", shape(Form::Sphere, Place::Similar.matrix()), Vec3::new(2.0, 1.0, 3.0)),
        ("mirrored sphere", shape(Form::Sphere, Place::MirroredSimilar.matrix()), Vec3::new(2.0, 1.0, 3.0)),
        ("far sphere", shape(Form::Sphere, Mat4::from_scale(Vec3::splat(0.01))), Vec3::new(20.0, 1.0, 3.0)),
        ("inside a sphere", shape(Form::Sphere, Place::Similar.matrix()), Vec3::new(0.3, 0.2, 0.4)),
        ("ellipsoid", shape(Form::Sphere, place), Vec3::new(2.0, 1.0, 3.0)),
        ("rectangle", shape(Form::Rectangle, place), Vec3::new(0.5, 0.4, 1.0)),
        ("rectangle from behind", shape(Form::Rectangle, place), Vec3::new(0.0, -0.4, -1.0)),
        ("far rectangle", shape(Form::Rectangle, place), Vec3::new(90.0, 40.0, 2000.0)),
        ("disc", shape(Form::Disc, place), Vec3::new(2.0, 1.0, 1.0)),
        ("cylinder", shape(Form::Cylinder, place), Vec3::new(3.0, 1.0, 1.0)),
        ("square mesh", shape(quad(0.0, [[0, 1, 2], [0, 2, 3]]), place), Vec3::new(0.5, 0.4, 1.5)),
        (
            "square mesh, turned",
            shape(quad(0.0, [[1, 3, 0], [2, 3, 1]]), Mat4::from_rotation_z(0.4)),
            Vec3::new(0.5, 0.4, 1.5),
        ),
        ("skew mesh", shape(quad(0.5, [[0, 1, 2], [0, 2, 3]]), place), Vec3::new(0.5, 0.4, 1.5)),
        (
            "one triangle",
            shape(Form::Mesh(Arc::new(one_triangle(What::MeshUv))), place),
            Vec3::new(0.5, 0.4, 2.5),
        ),
    ]
}

#[test]
fn light_samples_are_where_they_say_with_the_density_they_say() {
    for (name, light, reference) in lights() {
        let sampler = ShapeSampler::new(&light).unwrap().unwrap();
        let geometry = Geometry::build(&scene(vec![light.clone()])).unwrap();
        let mut rng = Pcg32::new(21, 3);
        let n = 20_000;
        // ∫ dω over the directions that meet the shape, by sampling it and by brute force, and the same of a
        // function of the direction.
        let weight = |w: Vec3| 1.0 + 0.5 * (40.0 * w.dot(Vec3::new(0.3, 0.9, -0.2)) + w.x).sin();
        let (mut sum, mut visible) = (0.0f64, 0);
        let mut mean_uv = Vec2::ZERO;
        for i in 0..n {
            // Stratified: 141 × 141 cells.
            let u = Vec2::new(
                ((i % 141) as f32 + rng.next_f32()) / 141.0,
                ((i / 141) as f32 + rng.next_f32()) / 142.0,
            );
            let Some(p) = sampler.sample(reference, u) else { continue };
            mean_uv += p.uv / n as f32;
            let ray = Ray::new(reference, (p.position - reference).normalize());
            let distance = (p.position - reference).length();
            let Some(hit) = geometry.intersect(&ray) else { continue };
            let s = geometry.surface(&ray, &hit);
            if (hit.t - distance).abs() > 1e-3 * distance {
                // The far side of a round thing.
                assert!(hit.t < distance);
                continue;
            }
            visible += 1;
            // At the silhouette of a round thing positions blur, and the density by area grows without bound.
            let cos = s.geometric_normal.dot(ray.dir).abs();
            assert!(
                (s.geometric_normal - p.normal).length() * cos < 1e-3,
                "{name}: {} {}",
                s.geometric_normal,
                p.normal
            );
            let uv = (s.uv - p.uv).abs();
            assert!(uv.length() * cos < 2e-3 || uv.max_element() > 0.99, "{name}: {} {}", s.uv, p.uv);
            let pdf = sampler.pdf(reference, &s);
            assert!((pdf / p.pdf - 1.0).abs() * cos < 1e-3, "{name}: {pdf} {}", p.pdf);
            sum += f64::from(weight(ray.dir) / p.pdf);
        }
        assert!(visible > n / 5, "{name}: {visible}");
        let estimate = sum / f64::from(n);

        // Brute force over a cap of directions around the shape.
        let (centre, radius) = geometry.bounds().bounding_sphere();
        let to = centre - reference;
        let cos_cap =
            if to.length() > 1.01 * radius { (1.0 - (radius / to.length()).powi(2)).sqrt() } else { -1.0 };
        let frame = yugen_optics::Frame::from_normal(to.normalize_or(Vec3::Z));
        let one_minus_cos =
            if cos_cap > 0.0 { (radius / to.length()).powi(2) / (1.0 + cos_cap) } else { 2.0 };
        let m = 400;
        let mut truth = 0.0f64;
        for i in 0..m * m {
            let (x, y) = ((i % m) as f32 + 0.5, (i / m) as f32 + 0.5);
            let drop = one_minus_cos * x / m as f32;
            let (sin, phi) = ((drop * (2.0 - drop)).max(0.0).sqrt(), std::f32::consts::TAU * y / m as f32);
            let dir = frame.to_world(Vec3::new(sin * phi.cos(), sin * phi.sin(), 1.0 - drop));
            let ray = Ray::new(reference, dir);
            if geometry.occluded(&ray) {
                truth += f64::from(weight(dir));
            }
        }
        truth *= f64::from(one_minus_cos) * std::f64::consts::TAU / f64::from(m * m);
        // Edges met by a grid of 400 × 400, and noise of 20 000 samples; worst seen 0.4 %.
        assert!((estimate / truth - 1.0).abs() < 0.015, "{name}: {estimate} {truth}");
    }
}

#[test]
fn areas_are_areas() {
    use std::f32::consts::PI;
    let area = |form: Form, m: Mat4| ShapeSampler::new(&shape(form, m)).unwrap().unwrap().area();
    let s = Place::Similar.matrix();
    assert!((area(Form::Sphere, s) / (4.0 * PI * 2.25) - 1.0).abs() < 1e-6);
    assert!((area(Form::Rectangle, s) / 9.0 - 1.0).abs() < 1e-6);
    assert!((area(Form::Disc, Place::Stretched.matrix()) / (PI * 1.5 * 0.7) - 1.0).abs() < 1e-6);
    assert!((area(Form::Cylinder, s) / (2.0 * PI * 2.25) - 1.0).abs() < 1e-6);
    // Oblate spheroid of half axes 2, 2, 1: 2πa²(1 + (1 − e²)/e · artanh e), e² = 3/4.
    let e = 0.75f32.sqrt();
    let exact = 2.0 * PI * 4.0 * (1.0 + 0.25 / e * e.atanh());
    assert!((area(Form::Sphere, Mat4::from_scale(Vec3::new(2.0, 2.0, 1.0))) / exact - 1.0).abs() < 1e-4);
    let mesh = Form::Mesh(Arc::new(one_triangle(What::Mesh)));
    assert!((area(mesh.clone(), s) / (1.25f32.sqrt() * 2.25) - 1.0).abs() < 1e-6);
    assert!(ShapeSampler::new(&shape(mesh, Mat4::from_scale(Vec3::ZERO))).unwrap().is_none());
    assert!(ShapeSampler::new(&shape(Form::Instance(0), s)).unwrap().is_none());
}

#[test]
fn boxes_hold_their_shapes() {
    // Rays at random find nothing outside of the box that the hierarchy was told.
    let mut rng = Pcg32::new(2, 2);
    for form in [Form::Sphere, Form::Disc, Form::Cylinder, Form::Rectangle] {
        let m = Place::Stretched.matrix();
        let geometry = Geometry::build(&scene(vec![shape(form.clone(), m)])).unwrap();
        let b = geometry.bounds();
        let inverse = Affine3A::from_mat4(m).inverse();
        let mut reach = [f32::INFINITY, f32::NEG_INFINITY];
        for _ in 0..200_000 {
            let p = rng.next_vec3() * 2.4 - 1.2;
            let q = match form {
                Form::Sphere => p.normalize(),
                Form::Cylinder => p.with_z(0.0).normalize().with_z((p.z * 0.5 + 0.5).clamp(0.0, 1.0)),
                Form::Disc => p.with_z(0.0) / p.with_z(0.0).length().max(1.0),
                _ => p.with_z(0.0).clamp(Vec3::NEG_ONE, Vec3::ONE),
            };
            let w = m.transform_point3(q);
            assert!(w.cmpge(b.lo - 1e-6).all() && w.cmple(b.hi + 1e-6).all(), "{form:?}");
            assert!((inverse.transform_point3(w) - q).length() < 1e-5);
            reach = [reach[0].min(w.x), reach[1].max(w.x)];
        }
        // And it is no larger than it must be.
        assert!(
            (reach[0] - b.lo.x).abs() < 0.01 && (reach[1] - b.hi.x).abs() < 0.01,
            "{form:?} {reach:?} {b:?}"
        );
    }
}
