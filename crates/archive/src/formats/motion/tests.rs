use super::*;
use glam::DVec3;
use yugen_motion::Placement;

/// The folder of real takes; `None` where there is none, which CI does not accept.
fn data() -> Option<PathBuf> {
    let Some(data) = std::env::var_os("YUGEN_DATA") else {
        assert!(std::env::var_os("CI").is_none(), "YUGEN_DATA must name the data folder in CI");
        println!("skipped: YUGEN_DATA is not set");
        return None;
    };
    Some(Path::new(&data).join("mocap"))
}

fn in_centimetres(path: &Path) -> SkeletalMotion {
    match load(path, &Options { unit: Some(0.01), ..Options::default() }).unwrap().motion {
        Motion::Skeletal(moved) => moved,
        Motion::Captured(_) => panic!("{}", path.display()),
    }
}

fn captured(path: &Path, options: &Options) -> Take {
    match load(path, options).unwrap().motion {
        Motion::Captured(take) => take,
        Motion::Skeletal(_) => panic!("{}", path.display()),
    }
}

/// Positions of the joints with channels, each times its number from one, in centimetres; and of the last.
fn weighted(moved: &SkeletalMotion, frame: usize) -> [DVec3; 2] {
    let joints = moved.skeleton.to_skeleton(&moved.pose(frame)).unwrap();
    let named = moved.skeleton.joints().iter().zip(&joints).filter(|(j, _)| !j.name.ends_with(" end"));
    let mut sum = [DVec3::ZERO; 2];
    for (i, (_, matrix)) in named.enumerate() {
        sum[1] = matrix.w_axis.truncate().as_dvec3() * 100.0;
        sum[0] += (i + 1) as f64 * sum[1];
    }
    sum
}

#[test]
fn real_skeletons_move_as_bvhio_sees_them() {
    let Some(data) = data() else { return };
    // Of bvhio 1.5.4: the frame; positions of all joints, each times its number from one, summed; the last joint.
    let cases = [
        (
            "test_freebvh.bvh",
            69,
            30.0,
            [
                (
                    0,
                    [-7629.852348804474, 110519.71715164185, 1406.0428042560816],
                    [8.756775, 3.925416, 4.151274],
                ),
                (
                    34,
                    [3924.4394971728325, 110409.89340209961, 146942.15883255005],
                    [17.275476, 4.48842, 60.256359],
                ),
                (
                    68,
                    [7630.8893602490425, 110519.79979419708, -1404.451555982232],
                    [-8.754364, 3.925428, -4.156063],
                ),
            ],
        ),
        (
            "joruri/clip_001Re.bvh",
            2847,
            120.0,
            [
                (
                    0,
                    [30734.657943725586, 33677.98589229584, -23048.139274597168],
                    [104.27385, 119.61583, -87.472366],
                ),
                (
                    1423,
                    [24474.530559539795, 32567.42538022995, -30701.61248779297],
                    [88.690628, 101.194885, -123.440887],
                ),
                (
                    2846,
                    [24818.9927444458, 35484.34865522385, -31103.275993347168],
                    [83.834305, 126.013664, -122.006157],
                ),
            ],
        ),
    ];
    let mut worst = [0.0f64; 2];
    for (file, frames, rate, all) in cases {
        let moved = in_centimetres(&data.join(file));
        assert_eq!((moved.frames, moved.rate), (frames, rate), "{file}");
        for (frame, sum, last) in all {
            let got = weighted(&moved, frame);
            let count = moved.skeleton.joints().len() as f64;
            // A weighted mean, as large as one joint's position is.
            let weights = count * (count + 1.0) / 2.0;
            worst[0] = worst[0].max(got[0].distance(DVec3::from_array(sum)) / weights);
            worst[1] = worst[1].max(got[1].distance(DVec3::from_array(last)));
        }
    }
    println!("off bvhio by {worst:?} cm");
    // Both compute in single precision, in which a step at 170 cm is 1.5e-5; both take a dozen joints to get there.
    assert!(worst[0] < 6e-5 && worst[1] < 2e-4, "{worst:?}");
    let still = in_centimetres(&data.join("joruri/smpl-T.bvh"));
    let sum = weighted(&still, 0)[0];
    assert!(sum.distance(DVec3::new(-1223.9466582, 37820.8625941, -1065.6937682)) / 300.0 < 6e-5, "{sum}");
    // A wrong order of channels would be seen.
    let text = std::fs::read_to_string(data.join("test_freebvh.bvh")).unwrap();
    let wrong = text.replace("Zrotation Yrotation Xrotation", "Xrotation Yrotation Zrotation");
    let options = Options { unit: Some(0.01), ..Options::default() };
    let Motion::Skeletal(wrong) = read(wrong.as_bytes(), Path::new("a.bvh"), &options).unwrap().motion else {
        panic!()
    };
    assert!(weighted(&wrong, 0)[1].distance(DVec3::new(8.756775, 3.925416, 4.151274)) > 1.0);
}

#[test]
fn a_real_capture_is_where_ezc3d_sees_it() {
    let Some(data) = data() else { return };
    let path = data.join("hdm05/HDM_dg_06-03_03_120.c3d");
    let asked = load(&path, &Options::default()).unwrap_err().to_string();
    assert!(asked.contains("does not say which axis is up: give --up y or --up z"), "{asked}");
    let options = Options { axes: "x y z".parse().ok(), ..Options::default() };
    let take = captured(&path, &options);
    let markers = &take.markers;
    assert_eq!((markers.rate, markers.frames, markers.tracks.len()), (120.0, 202, 44));
    assert_eq!(markers.start, 2924.0 / 120.0);
    assert_eq!((markers.tracks[0].name.as_str(), markers.tracks[43].name.as_str()), ("*0", "Daniel:RMT5"));
    assert!(markers.tracks.iter().all(|t| t.missing() == 0));
    // Of ezc3d 1.7.2, in mm, as above; the last is the mean of all frames.
    let sum = |frame: usize| {
        let each = markers.tracks.iter().enumerate();
        each.map(|(i, t)| (i + 1) as f64 * t.samples[frame].unwrap().as_dvec3() * 1000.0).sum::<DVec3>()
    };
    for (frame, want) in [
        (0, [1347088.6593017578, 1279263.448791504, 747768.6273403168]),
        (101, [-202616.29677152634, -241813.31619727612, 786671.2745933533]),
        (201, [-1634415.7746582031, -1651077.9533691406, 791436.5946235657]),
    ] {
        // Metres in floats: a step at 2 m is 2.4e-4 mm, and weights add up to 990.
        let off = sum(frame).distance(DVec3::from_array(want)) / 990.0;
        assert!(off < 2e-4, "{frame}: {off} mm");
    }
    let mean = (0..202).map(sum).sum::<DVec3>() / 202.0;
    let want = DVec3::new(-179594.02107938682, -220171.68907835166, 752642.3782205393);
    assert!(mean.distance(want) / 990.0 < 2e-4, "{mean}");
}

#[test]
fn one_performance_is_the_same_in_bvh_and_trc() {
    let Some(data) = data() else { return };
    let moved = in_centimetres(&data.join("joruri/clip_001Re.bvh"));
    let take = captured(&data.join("joruri/clip_001Re.trc"), &Options::default());
    assert_eq!((take.markers.frames, take.markers.rate, take.markers.tracks.len()), (2847, 120.0, 29));
    let names: Vec<String> = moved.skeleton.joints().iter().map(|j| j.name.replace(" end", "_End")).collect();
    let mut worst = 0.0f32;
    for frame in 0..moved.frames {
        let joints = moved.skeleton.to_skeleton(&moved.pose(frame)).unwrap();
        for (name, joint) in names.iter().zip(joints) {
            let marker = take.markers.find(name).unwrap().samples[frame].unwrap();
            worst = worst.max(marker.distance(joint.w_axis.truncate()));
        }
    }
    println!("BVH and TRC differ by {} mm", 1000.0 * worst);
    // .6 micrometres; the TRC has five decimals of millimetres.
    assert!(worst < 2.5e-6, "{worst}");
}

#[test]
fn a_solved_skeleton_is_among_its_markers() {
    let Some(data) = data() else { return };
    let amc = data.join("hdm05/HDM_dg_06-03_03_120.amc");
    let unsaid = load(&amc, &Options::default()).unwrap_err().to_string();
    assert!(unsaid.contains("give --rate"), "{unsaid}");
    let loaded = load(&amc, &Options { rate: Some(120.0), ..Options::default() }).unwrap();
    assert_eq!(loaded.unit.1, Basis::Stated);
    let Motion::Skeletal(moved) = loaded.motion else { panic!() };
    assert_eq!((moved.frames, moved.skeleton.joints().len()), (202, 31 + 7));
    // Its world has x where the markers have y.
    let axes = Options { axes: "z x y".parse().ok(), ..Options::default() };
    let take = captured(&data.join("hdm05/HDM_dg_06-03_03_120.c3d"), &axes);
    let joint = |name: &str| moved.skeleton.joints().iter().position(|j| j.name == name).unwrap();
    // Forward kinematics of the two files in numpy, in double precision.
    let ends = [
        ("lfingers", 0, [1.0491845222665266, 1.0974990529986768, 1.4175449520207744]),
        ("lfingers", 201, [-1.9524165231919413, 1.1835868261972942, -1.5334411563216266]),
        ("rtoes end", 0, [1.4499009127678757, 0.012011304931111279, 1.482919745599629]),
        ("rtoes end", 201, [-1.3621463644752945, 0.13424759455933283, -1.4309126542961128]),
        ("head end", 0, [1.2330083433889942, 1.699191554446789, 1.3018484330589697]),
        ("head end", 201, [-1.6978243004456788, 1.7586636708087733, -1.6288124721336283]),
    ];
    for (name, frame, want) in ends {
        let at = moved.skeleton.to_skeleton(&moved.pose(frame)).unwrap()[joint(name)].w_axis.truncate();
        let off = at.as_dvec3().distance(DVec3::from_array(want));
        println!("{name} in frame {frame} is off by {off} m");
        // The worst is 2.2e-7: single precision.
        assert!(off < 1e-6, "{name} {frame}: {at}");
    }
    // And the markers say the same: a joint is under them by half a limb and the skin.
    let pairs = [
        ("lhand", ["LWRA", "LWRB"]),
        ("rhand", ["RWRA", "RWRB"]),
        ("ltibia", ["LKNE", "LKNE"]),
        ("rtibia", ["RKNE", "RKNE"]),
        ("lradius", ["LELB", "LELB"]),
        ("rfoot", ["RANK", "RANK"]),
    ];
    for (name, markers) in pairs {
        let mut sum = 0.0;
        for frame in 0..202 {
            let joints = moved.skeleton.to_skeleton(&moved.pose(frame)).unwrap();
            let seen =
                markers.map(|m| take.markers.find(&format!("Daniel:{m}")).unwrap().samples[frame].unwrap());
            sum += joints[joint(name)].w_axis.truncate().distance((seen[0] + seen[1]) / 2.0);
        }
        let mean = sum / 202.0;
        println!("{name} is {:.1} mm from {markers:?}", 1000.0 * mean);
        // The farthest, a knee, has 76 mm.
        assert!(mean < 0.09, "{name}: {mean} m");
    }
}

const BVH: &str = "HIERARCHY\nROOT hips\n{\nOFFSET 0 90 0\nCHANNELS 3 Xrotation Yrotation Zrotation\nJOINT head\n{\n\
    OFFSET 10 80 0\nCHANNELS 3 Xrotation Yrotation Zrotation\nEnd Site\n{\nOFFSET 0 5 0\n}\n}\n}\n\
    MOTION\nFrames: 1\nFrame Time: .04\n0 0 0 0 0 0\n";

fn told(text: &str, file: &str, options: &Options) -> Result<Loaded, String> {
    read(text.as_bytes(), Path::new(file), options).map_err(|e| e.to_string())
}

#[test]
fn what_nobody_says_is_asked_for_or_guessed() {
    let asked = told(BVH, "a.bvh", &Options::default()).unwrap_err();
    assert_eq!(
        asked,
        "a.bvh: the file does not say its unit of length: give --unit m, cm or mm (what moves is 85.0000 large, as in cm)"
    );
    let guess = Options { guess: true, ..Options::default() };
    let loaded = told(BVH, "a.bvh", &guess).unwrap();
    assert_eq!((loaded.unit, loaded.axes.1), ((0.01, Basis::Guessed), Basis::Usual));
    assert!(loaded.doubts.is_empty(), "{:?}", loaded.doubts);
    let head = loaded.motion.points(0)[1];
    assert!(head.distance(Vec3::new(0.1, 1.7, 0.0)) < 1e-6, "{head}");
    // z up in a file whose format has y up.
    let lying = BVH.replace("OFFSET 10 80 0", "OFFSET 10 0 80").replace("OFFSET 0 5 0", "OFFSET 0 0 5");
    let loaded = told(&lying, "a.bvh", &guess).unwrap();
    assert!(loaded.doubts[0].contains("stands tallest along z: give --up z"), "{:?}", loaded.doubts);
    let given = Options { axes: up('z'), unit: Some(0.01), ..Options::default() };
    let loaded = told(&lying, "a.bvh", &given).unwrap();
    let head = loaded.motion.points(0)[1];
    assert!(loaded.doubts.is_empty() && head.distance(Vec3::new(0.1, 0.8, -0.9)) < 1e-6, "{head}");
    // Every frame alike, zero long: no unit can be told, and nothing breaks.
    let flat = BVH.replace("90", "0").replace("80", "0").replace("10", "0").replace("5 0\n}", "0 0\n}");
    assert!(told(&flat, "a.bvh", &guess).is_ok());
}

#[test]
fn millimetres_called_metres_are_noticed() {
    let trc = |unit: &str| {
        format!(
            "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tNumFrames\tNumMarkers\tUnits\n60\t1\t2\t{unit}\nFrame#\tTime\ttoe\t\t\thead\t\t\n\
             \t\tX1\tY1\tZ1\tX2\tY2\tZ2\n1\t0\t0\t10\t0\t0\t1710\t100\n"
        )
    };
    assert!(told(&trc("mm"), "a.trc", &Options::default()).is_ok());
    let said = told(&trc("m"), "a.trc", &Options::default()).unwrap_err();
    assert_eq!(
        said,
        "a.trc: in m, as the file says, what moves would be 1700.0000 m large; its unit is probably mm: give it with --unit"
    );
    let given = Options { unit: Some(0.001), ..Options::default() };
    assert!(told(&trc("m"), "a.trc", &given).is_ok());
    assert!(told(&trc("m"), "a.trc", &Options { rate: Some(0.0), ..given }).unwrap_err().contains("no rate"));
}

#[test]
fn formats_are_told_by_their_bytes() {
    let name = |file: &str, bytes: &[u8]| format_of(bytes, Path::new(file)).map(|f| f.name).unwrap_or("none");
    assert_eq!(name("a.csv", b"\xef\xbb\xbfFormat Version,1.23,"), "OptiTrack Motive CSV");
    assert_eq!(name("a.csv", b"Trajectories\r\n100\r\n"), "Vicon CSV");
    assert_eq!(name("a.tsv", b"NO_OF_FRAMES\t2\r\n"), "Qualisys TSV");
    assert_eq!(name("a.csv", b"# x\nseconds,kind,name,x,y,z\n"), "Yugen CSV");
    assert_eq!(name("a.csv", b"light;file;seconds\n"), "none");
    let other = format_of(b"", Path::new("a.bvhh")).err().unwrap().to_string();
    assert!(other.contains("unknown motion file extension 'bvhh'; did you mean 'bvh'?"), "{other}");
}

#[test]
fn angles_turn_about_the_axes_of_their_name() {
    let about = |axis: Vec3, angle: f32| glam::Quat::from_axis_angle(axis, angle);
    let v = Vec3::new(0.3, -0.7, 1.1);
    let [x, y, z] = [about(Vec3::X, v.x), about(Vec3::Y, v.y), about(Vec3::Z, v.z)];
    for (name, want) in [("xyz", x * y * z), ("zyx", z * y * x), ("yzx", y * z * x), ("zxy", z * x * y)] {
        let got = Angles::from_name(name).unwrap().rotation(v);
        assert!(got.dot(want).abs() > 1.0 - 1e-6, "{name}");
    }
    assert!(Angles::Helical.rotation(Vec3::Z).abs_diff_eq(glam::Quat::from_rotation_z(1.0), 1e-6));
}

fn skeletal(loaded: Loaded) -> SkeletalMotion {
    match loaded.motion {
        Motion::Skeletal(moved) => moved,
        Motion::Captured(_) => panic!(),
    }
}

/// The largest distance between joints of the same names, in some frames.
fn apart(a: &SkeletalMotion, b: &SkeletalMotion) -> f32 {
    assert_eq!(a.frames.max(1), b.frames.max(1));
    assert!(a.frames == 0 || a.rate == b.rate);
    let mut worst = 0.0f32;
    for frame in (0..a.frames.max(1)).step_by((a.frames / 50).max(1)) {
        let at = |m: &SkeletalMotion| {
            let poses = m.poses(frame).unwrap();
            m.skeleton.joints().iter().map(|j| j.name.clone()).zip(poses).collect::<Vec<_>>()
        };
        let (one, two) = (at(a), at(b));
        for (name, pose) in &one {
            let (_, other) = two.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no joint {name}"));
            worst = worst.max(pose.position.distance(other.position));
            // What a quarter of a metre on it would be off.
            let turned = (pose.rotation * Vec3::ONE).distance(other.rotation * Vec3::ONE);
            worst = worst.max(if name.ends_with(" end") { 0.0 } else { 0.15 * turned });
        }
    }
    worst
}

#[test]
fn skeletons_are_read_as_they_are_written() {
    let Some(data) = data() else { return };
    let guess = Options { guess: true, rate: None, ..Options::default() };
    let amc = Options { rate: Some(120.0), ..guess.clone() };
    let mut worst = [0.0f32; 2];
    for (file, options) in [
        ("test_freebvh.bvh", &guess),
        ("joruri/clip_001Re.bvh", &guess),
        ("joruri/smpl-T.bvh", &guess),
        ("hdm05/HDM_dg_06-03_03_120.amc", &amc),
        ("hdm05/HDM_dg.asf", &guess),
    ] {
        let moved = skeletal(load(&data.join(file), options).unwrap());
        let text = bvh::write(&moved, Path::new("a.bvh")).unwrap();
        let centimetres = Options { unit: Some(0.01), ..Options::default() };
        let back = skeletal(read(text.as_bytes(), Path::new("a.bvh"), &centimetres).unwrap());
        assert_eq!(back.skeleton.joints().len(), moved.skeleton.joints().len(), "{file}");
        worst[0] = worst[0].max(apart(&moved, &back));
        let bytes = gltf::write(&moved, Path::new("a.glb")).unwrap();
        if moved.frames > 1 {
            let back = skeletal(read(&bytes, Path::new("a.glb"), &Options::default()).unwrap());
            assert_eq!(back.skeleton.joints().len(), moved.skeleton.joints().len(), "{file}");
            worst[1] = worst[1].max(apart(&moved, &back));
        } else {
            // One that does not move is seen nonetheless.
            let scene = crate::formats::gltf::read(&bytes, Path::new("a.glb"), &Default::default());
            assert!(scene.unwrap().bounds().is_some(), "{file}");
        }
    }
    println!("BVH and glTF come back within {worst:?} m");
    // .6 and .4 micrometres: sines of floats, a dozen joints long.
    assert!(worst[0] < 2.5e-6 && worst[1] < 2.5e-6, "{worst:?}");
}

#[test]
fn figures_of_other_programs_are_read_with_their_scales() {
    let Some(data) = data() else { return };
    let fox = data.join("../mesh/gltf/Fox.glb");
    let run = Options { animation: Some("Run".into()), ..Options::default() };
    // In centimetres, though glTF has metres.
    let large = load(&fox, &run).unwrap_err().to_string();
    assert!(large.contains("its unit is probably cm: give it with --unit"), "{large}");
    let run = Options { unit: Some(0.01), ..run };
    let moved = skeletal(load(&fox, &run).unwrap());
    assert_eq!(moved.clip.name, "Run");
    let text = bvh::write(&moved, Path::new("a.bvh")).unwrap();
    let back = skeletal(read(text.as_bytes(), Path::new("a.bvh"), &run).unwrap());
    let size = Motion::Skeletal(moved.clone()).size().height;
    let mut worst = 0.0f32;
    for frame in 0..moved.frames {
        let (a, b) = (moved.poses(frame).unwrap(), back.poses(frame).unwrap());
        let names =
            |m: &SkeletalMotion| m.skeleton.joints().iter().map(|j| j.name.clone()).collect::<Vec<_>>();
        let (from, to) = (names(&moved), names(&back));
        for (name, pose) in from.iter().zip(&a) {
            if let Some(i) = to.iter().position(|n| n == name) {
                worst = worst.max(pose.position.distance(b[i].position));
            }
        }
    }
    println!("a fox of {size} comes back within {worst}");
    assert!(f64::from(worst) < 1e-5 * size);
    let other = load(&fox, &Options { animation: Some("Rum".into()), ..Options::default() }).unwrap_err();
    assert!(other.to_string().contains("no animation called 'Rum'; did you mean 'Run'?"), "{other}");
}

#[test]
fn takes_are_read_as_they_are_written() {
    let Some(data) = data() else { return };
    let options = Options { axes: "z x y".parse().ok(), ..Options::default() };
    let mut take = captured(&data.join("hdm05/HDM_dg_06-03_03_120.c3d"), &options);
    // With a gap, and with bodies.
    take.markers.tracks[7].samples[20..50].fill(None);
    let amc = Options { rate: Some(120.0), ..Options::default() };
    let moved = skeletal(load(&data.join("hdm05/HDM_dg_06-03_03_120.amc"), &amc).unwrap());
    take.bodies = moved.take().unwrap().bodies;
    take.bodies.start = take.markers.start;
    let csv = table::write(&take);
    let back = match read(csv.as_bytes(), Path::new("a.csv"), &Options::default()).unwrap().motion {
        Motion::Captured(back) => back,
        Motion::Skeletal(_) => panic!(),
    };
    // Floats have come back to the last bit, rotations to their length.
    assert_eq!(back.markers, take.markers);
    assert_eq!((back.bodies.rate, back.bodies.frames), (120.0, 202));
    let c3d = c3d::write(&take, Path::new("a.c3d")).unwrap();
    let again = match read(&c3d, Path::new("a.c3d"), &Options::default()).unwrap().motion {
        Motion::Captured(back) => back,
        Motion::Skeletal(_) => panic!(),
    };
    for other in [&back, &again] {
        assert!((other.markers.start - take.markers.start).abs() < 1e-9);
        assert_eq!(other.markers.tracks[7].gaps(), [[20, 30]]);
        let points = other.markers.tracks.iter().zip(&take.markers.tracks);
        let points = points.flat_map(|(a, b)| a.samples.iter().zip(&b.samples));
        let off = points.filter_map(|(a, b)| Some(a.as_ref()?.distance((*b)?)));
        assert!(off.fold(0.0, f32::max) < 1e-6);
        let bodies = other.bodies.tracks.iter().zip(&take.bodies.tracks);
        for (a, b) in bodies.flat_map(|(a, b)| a.samples.iter().zip(&b.samples)) {
            let (a, b) = (a.unwrap(), b.unwrap());
            assert!(a.position.distance(b.position) < 1e-6);
            assert!((a.rotation * Vec3::ONE).distance(b.rotation * Vec3::ONE) < 2e-6);
        }
    }
}

#[test]
fn a_real_capture_is_solved_as_its_makers_did() {
    use yugen_motion::solve::{SolveOptions, VICON, bodies, solve};
    let Some(data) = data() else { return };
    let axes = Options { axes: "z x y".parse().ok(), ..Options::default() };
    let take = captured(&data.join("hdm05/HDM_dg_06-03_03_120.c3d"), &axes);
    let amc = Options { rate: Some(120.0), ..Options::default() };
    let theirs = skeletal(load(&data.join("hdm05/HDM_dg_06-03_03_120.amc"), &amc).unwrap());
    let clusters = bodies(&take.markers, &VICON);
    assert_eq!(clusters.tracks.len(), 15);
    for track in &clusters.tracks {
        let mean = track.residuals.iter().sum::<f32>() / track.residuals.len() as f32;
        println!("{} keeps its shape within {:.1} mm", track.name, 1000.0 * mean);
    }
    let solved = solve(&clusters, &SolveOptions::default()).unwrap();
    for fit in &solved.fits {
        println!("{fit:?}");
    }
    let joint =
        |m: &SkeletalMotion, name: &str| m.skeleton.joints().iter().position(|j| j.name == name).unwrap();
    let pairs = [
        ("thigh", "femur", "hip"),
        ("shank", "tibia", "knee"),
        ("foot", "foot", "ankle"),
        ("upper_arm", "humerus", "shoulder"),
        ("forearm", "radius", "elbow"),
        ("hand", "hand", "wrist"),
    ];
    let mut all = Vec::new();
    for (ours, other, name) in pairs {
        for (side, letter) in [("left", "l"), ("right", "r")] {
            let one = joint(&solved.motion, &format!("{side}_{ours}"));
            let two = joint(&theirs, &format!("{letter}{other}"));
            let mut sum = 0.0;
            for frame in 0..202 {
                let at = |m: &SkeletalMotion, j: usize| m.poses(frame).unwrap()[j].position;
                sum += at(&solved.motion, one).distance_squared(at(&theirs, two));
            }
            let off = (sum / 202.0).sqrt();
            println!("{side} {name}: {:.1} mm", 1000.0 * off);
            all.push(off);
        }
    }
    let rms = (all.iter().map(|o| o * o).sum::<f32>() / all.len() as f32).sqrt();
    println!("joints are {:.1} mm from those of the makers", 1000.0 * rms);
    // 61 mm: their knees and elbows are in the middle of the limb, ours on the axis about which it bends, nearest to
    // markers that are all on its outside (a knee's is 60 and 76 mm from theirs, as the test above has it).
    assert!(rms < 0.08, "{rms}");
}

#[test]
fn joints_that_are_markers_become_a_skeleton() {
    use yugen_motion::solve::{SMPL, SolveOptions, solve_points};
    let Some(data) = data() else { return };
    let take = captured(&data.join("joruri/clip_001Re.trc"), &Options::default());
    let tree = SMPL.map(|(a, b)| (a.to_string(), b.to_string())).to_vec();
    // Unfiltered: what is left is what bones of one length do.
    let options = SolveOptions { tree, cutoff: 1e3, ..SolveOptions::default() };
    let solved = solve_points(&take.markers, &options).unwrap();
    let theirs = in_centimetres(&data.join("joruri/clip_001Re.bvh"));
    let worst = solved.fits.iter().map(|f| f.position_off).fold(0.0, f64::max);
    println!("29 joints are met within {:.4} mm", 1000.0 * worst);
    let mut bones = 0.0f64;
    for fit in &solved.fits {
        let joint =
            theirs.skeleton.joints().iter().find(|j| j.name.replace(" end", "_End") == fit.name).unwrap();
        let Placement::Parts(parts) = joint.rest else { panic!() };
        let root = joint.parent.is_none();
        bones = bones.max(if root { 0.0 } else { (f64::from(parts.translation.length()) - fit.bone).abs() });
    }
    println!("bones differ from those of the BVH by {:.4} mm", 1000.0 * bones);
    // 2 micrometres, and bones to the last digit of the file.
    assert!(worst < 8e-6 && bones < 1e-6, "{worst} {bones}");
}
