use super::*;

/// Group, name, type, sizes, numbers or text.
type Said = (&'static str, &'static str, i8, Vec<u8>, Vec<f64>, &'static str);

/// What a file of the tests has.
struct Fake {
    processor: Processor,
    /// Below zero: floats.
    scale: f32,
    /// Points of frame after frame: three numbers and the fourth.
    points: Vec<Vec<[f32; 4]>>,
    /// Words of analog data behind the points of a frame.
    analog: usize,
    /// In the order of their groups.
    parameters: Vec<Said>,
    /// Frames of bodies: 17 numbers each.
    bodies: Vec<Vec<[f32; 17]>>,
}

impl Fake {
    fn i16(&self, v: i16) -> [u8; 2] {
        if self.processor == Processor::Mips { v.to_be_bytes() } else { v.to_le_bytes() }
    }

    fn f32(&self, v: f32) -> [u8; 4] {
        match self.processor {
            Processor::Intel => v.to_le_bytes(),
            Processor::Mips => v.to_be_bytes(),
            Processor::Dec => {
                let [a, b, c, d] = (if v == 0.0 { 0.0 } else { v * 4.0 }).to_bits().to_le_bytes();
                [c, d, a, b]
            }
        }
    }

    fn bytes(&self) -> Vec<u8> {
        let (used, frames) = (self.points.first().map_or(0, Vec::len), self.points.len());
        let (data, width) = (4, if self.scale < 0.0 { 4 } else { 2 });
        let size = frames * width * (4 * used + self.analog);
        let rotation = data + size.div_ceil(BLOCK);
        let mut out = vec![0; BLOCK];
        out[..2].copy_from_slice(&[2, KEY]);
        let mut put = |word: usize, v: i16| out[2 * word - 2..2 * word].copy_from_slice(&self.i16(v));
        put(2, used as i16);
        put(3, self.analog as i16);
        put(4, 11);
        put(5, 10 + frames as i16);
        put(9, data as i16);
        out[12..16].copy_from_slice(&self.f32(self.scale));
        out[20..24].copy_from_slice(&self.f32(120.0));
        let kind = match self.processor {
            Processor::Intel => 84,
            Processor::Dec => 85,
            Processor::Mips => 86,
        };
        out.extend([1, KEY, 2, kind]);
        let mut groups: Vec<&str> = Vec::new();
        let entry = |out: &mut Vec<u8>, name: &str, id: i8, body: &[u8]| {
            out.extend([name.len() as u8, id as u8]);
            out.extend(name.as_bytes());
            out.extend(self.i16(body.len() as i16 + 3));
            out.extend(body);
            out.push(0);
        };
        for (group, name, kind, sizes, numbers, text) in &self.parameters {
            let id = groups.iter().position(|g| g == group).unwrap_or_else(|| {
                groups.push(group);
                entry(&mut out, group, -(groups.len() as i8), &[]);
                groups.len() - 1
            });
            let mut body = vec![*kind as u8, sizes.len() as u8];
            body.extend(sizes);
            body.extend(text.as_bytes());
            for n in numbers {
                // Stands for the block of the bodies.
                let n = if n.is_infinite() { rotation as f64 } else { *n };
                if *kind == 2 { body.extend(self.i16(n as i16)) } else { body.extend(self.f32(n as f32)) }
            }
            entry(&mut out, name, id as i8 + 1, &body);
        }
        out.resize((data - 1) * BLOCK, 0);
        for frame in &self.points {
            for p in frame {
                for v in p {
                    if width == 4 { out.extend(self.f32(*v)) } else { out.extend(self.i16(*v as i16)) }
                }
            }
            out.extend(std::iter::repeat_n(0x77, width * self.analog));
        }
        out.resize((rotation - 1) * BLOCK, 0);
        for v in self.bodies.iter().flatten().flatten() {
            out.extend(self.f32(*v));
        }
        out
    }

    fn take(&self) -> Result<(Take, Conventions), String> {
        match read(&self.bytes(), Path::new("a.c3d"), &Options::default()) {
            Ok((Motion::Captured(take), said)) => Ok((take, said)),
            Ok(_) => panic!(),
            Err(e) => Err(e.to_string()),
        }
    }
}

fn fake(processor: Processor, scale: f32) -> Fake {
    // In multiples of the scale where they are integers.
    let points = vec![
        vec![[100.0, -200.0, 300.0, 5.0], [1.0, 2.0, 3.0, 0.0]],
        vec![[101.0, -201.0, 301.0, 261.0], [0.0, 0.0, 0.0, -1.0]],
        vec![[102.0, -202.0, 302.0, 0.0], [0.0, 0.0, 0.0, 0.0]],
    ];
    let parameters = vec![
        ("POINT", "USED", 2, vec![], vec![2.0], ""),
        ("POINT", "LABELS", -1, vec![4, 2], vec![], "toe heel"),
        ("POINT", "UNITS", -1, vec![2], vec![], "mm"),
        ("POINT", "RATE", 4, vec![], vec![120.0], ""),
    ];
    Fake { processor, scale, points, analog: 3, parameters, bodies: Vec::new() }
}

#[test]
fn every_processor_and_both_kinds_of_numbers_say_the_same() {
    for processor in [Processor::Intel, Processor::Dec, Processor::Mips] {
        for scale in [-0.5f32, 0.5] {
            let (take, said) = fake(processor, scale).take().unwrap();
            let unit = if scale < 0.0 { 1.0 } else { scale };
            let markers = &take.markers;
            assert_eq!((markers.rate, markers.frames, said.unit, said.axes), (120.0, 3, Some(0.001), None));
            assert_eq!(markers.start, 10.0 / 120.0);
            let toe = markers.find("toe").unwrap();
            assert_eq!(toe.samples[1], Some(Vec3::new(101.0, -201.0, 301.0) * unit), "{processor:?} {scale}");
            // 261 is camera 1 and a residual of 5.
            assert_eq!(toe.residuals, [2.5, 2.5, 0.0]);
            assert_eq!(markers.find("heel").unwrap().gaps(), [[1, 2]], "{processor:?} {scale}");
        }
    }
    // A PDP's number by hand: 1.0 is 0x4080 and 0x0000.
    assert_eq!(Processor::Dec.f32([0x80, 0x40, 0, 0]), 1.0);
    assert_eq!(Processor::Dec.f32([0x80, 0xc0, 0, 0]), -1.0);
    assert_eq!(Processor::Dec.f32([0, 0, 0, 0]), 0.0);
}

/// A matrix of seeded random numbers that ezc3d 1.7.2 wrote, as its file has it: columns, then how well it is known.
const WRITTEN: [u32; 17] = [
    0x3eb4d073, 0x3f6f0a92, 0xbd6e4bb0, 0, 0x3f684049, 0xbea738ef, 0x3e87b6d5, 0, 0x3e69fd8a, 0xbe15e72b,
    0xbf7664a7, 0, 0x4355a49b, 0x4359526a, 0x45045d6c, 0x3f800000, 0,
];

#[test]
fn rigid_bodies_are_where_ezc3d_wrote_them() {
    for processor in [Processor::Intel, Processor::Dec, Processor::Mips] {
        let written = WRITTEN.map(f32::from_bits);
        let mut unseen = written;
        unseen[16] = -1.0;
        let mut file = fake(processor, -1.0);
        file.points = vec![vec![[1.0, 2.0, 3.0, 0.0]; 2]; 2];
        file.bodies = vec![vec![written, unseen], vec![unseen, written], vec![unseen; 2], vec![written; 2]];
        file.parameters.extend([
            ("ROTATION", "USED", 2, vec![], vec![2.0], ""),
            ("ROTATION", "DATA_START", 2, vec![], vec![f64::INFINITY], ""),
            ("ROTATION", "RATIO", 2, vec![], vec![2.0], ""),
            ("ROTATION", "LABELS", -1, vec![4, 2], vec![], "headhand"),
        ]);
        let (take, _) = file.take().unwrap();
        assert_eq!((take.bodies.rate, take.bodies.frames), (240.0, 4));
        assert_eq!(take.bodies.find("head").unwrap().gaps(), [[1, 2]]);
        assert_eq!(take.bodies.find("hand").unwrap().gaps(), [[0, 1], [2, 1]]);
        let pose = take.bodies.tracks[0].samples[0].unwrap();
        // What ezc3d's reader says of that file, to all digits of a float.
        let matrix = [
            [0.353_152_841, 0.907_230_914, 0.228_506_237],
            [0.933_755_04, -0.326_606_244, -0.146_389_648],
            [-0.058_177_65, 0.265_066_773, -0.962_473_333],
        ];
        let place = Vec3::new(213.642_99, 217.321_93, 2_117.838_87);
        assert!(pose.position.distance(place) < 1e-3, "{}", pose.position);
        let got = Mat3::from_quat(pose.rotation).transpose().to_cols_array_2d();
        for (got, want) in got.iter().flatten().zip(matrix.iter().flatten()) {
            assert!((got - want).abs() < 1e-6, "{got} {want}");
        }
        // RATE says it as well, and so does neither.
        file.parameters.retain(|p| p.1 != "RATIO");
        assert_eq!(file.take().unwrap().0.bodies.frames, 2);
        file.parameters.push(("ROTATION", "RATE", 4, vec![], vec![240.0], ""));
        assert_eq!(file.take().unwrap().0.bodies.frames, 4);
    }
}

#[test]
fn what_a_file_lacks_comes_from_its_header() {
    let mut file = fake(Processor::Intel, 0.1);
    file.parameters.clear();
    let (take, said) = file.take().unwrap();
    assert_eq!((take.markers.rate, take.markers.frames, said), (120.0, 3, Conventions::default()));
    let names: Vec<&str> = take.markers.tracks.iter().map(|t| t.name.as_str()).collect();
    assert_eq!(names, ["point 1", "point 2"]);
}

#[test]
fn the_screen_says_which_way_is_up() {
    let file_up = |right: &'static str, up: &'static str| {
        let mut file = fake(Processor::Intel, 0.1);
        file.parameters.push(("POINT", "X_SCREEN", -1, vec![2], vec![], right));
        file.parameters.push(("POINT", "Y_SCREEN", -1, vec![2], vec![], up));
        file.take().unwrap().1.axes.map(|(axes, basis)| (axes.to_string(), basis))
    };
    assert_eq!(file_up("+X", "+Z"), Some(("x -z y".into(), Basis::Stated)));
    assert_eq!(file_up("+X", "+Y"), Some(("x y z".into(), Basis::Stated)));
    assert_eq!(file_up("+Y", "+Z"), Some(("z x y".into(), Basis::Stated)));
    assert_eq!(file_up("-X", "-Z"), Some(("-x -z -y".into(), Basis::Stated)));
    assert_eq!(file_up("+X", "+X"), None);
}

#[test]
fn what_is_wrong_is_said() {
    let said = |change: &dyn Fn(&mut Fake)| {
        let mut file = fake(Processor::Intel, -0.1);
        change(&mut file);
        file.take().unwrap_err()
    };
    let parameter = |group, name, value: f64| {
        move |f: &mut Fake| {
            f.parameters.retain(|p| (p.0, p.1) != (group, name));
            f.parameters.push((group, name, 2, vec![], vec![value], ""));
        }
    };
    assert!(said(&parameter("POINT", "USED", 9.0)).contains("the header has 2 points, the parameters 9"));
    assert!(said(&parameter("POINT", "SCALE", 0.0)).contains("the scale of the points is 0"));
    assert!(said(&parameter("ROTATION", "USED", 2.0)).contains("ROTATION has no DATA_START"));
    let furlong = said(&|f| f.parameters[2].5 = "fu");
    assert!(furlong.contains("unknown unit in POINT:UNITS 'fu'"), "{furlong}");
    let bent = said(&|f| {
        let mut body = WRITTEN.map(f32::from_bits);
        body[0] = 2.0;
        f.bodies = vec![vec![body]; 3];
        f.parameters.push(("ROTATION", "USED", 2, vec![], vec![1.0], ""));
        f.parameters.push(("ROTATION", "DATA_START", 2, vec![], vec![f64::INFINITY], ""));
    });
    assert!(bent.contains("the matrix of 'body 1' in frame 1 is no rotation"), "{bent}");

    let error = |bytes: &[u8]| read(bytes, Path::new("a.c3d"), &Options::default()).unwrap_err().to_string();
    let whole = fake(Processor::Intel, -0.1).bytes();
    let cut = error(&whole[..3 * BLOCK + 60]);
    assert!(cut.contains("3 frames are announced, but there are 1; the file may be cut off"), "{cut}");
    assert!(error(b"PK\x03\x04").starts_with("a.c3d, byte 0: expected 0x50 in the second byte"));
    assert!(error(&[2, 0x50]).contains("the file ends here"));
    let mut other = whole.clone();
    other[BLOCK + 3] = 99;
    assert!(error(&other).contains("the processor is 99"));
    let mut still = whole;
    still[20..24].fill(0);
    still.truncate(BLOCK);
    still.extend([1, KEY, 1, 84, 0, 0]);
    assert!(error(&still).contains("--rate"));
}

#[test]
fn what_is_written_is_read_again() {
    let markers = Tracks { rate: 60.0, start: 0.5, frames: 3, tracks: Vec::new() };
    let mut take = Take { markers, ..Take::default() };
    for i in 0..300 {
        let samples =
            (0..3).map(|f| (f != i % 4).then(|| Vec3::new(i as f32 / 7.0, f as f32, -0.3))).collect();
        let name = format!("marker {i}");
        take.markers.tracks.push(Track { name, samples, residuals: Vec::new() });
    }
    take.markers.tracks[0].residuals = vec![0.0, 0.001, 0.0005];
    take.bodies = Tracks { rate: 120.0, start: 0.5, frames: 6, tracks: Vec::new() };
    let pose = |f: usize| RigidPose {
        position: Vec3::new(1.0, f as f32, 2.0),
        rotation: Quat::from_rotation_y(f as f32) * Quat::from_rotation_x(1.0),
    };
    let samples = (0..6).map(|f| (f != 2).then(|| pose(f))).collect();
    take.bodies.tracks.push(Track { name: "fan".into(), samples, residuals: Vec::new() });
    let bytes = write(&take, Path::new("a.c3d")).unwrap();
    let Motion::Captured(mut back) = read(&bytes, Path::new("a.c3d"), &Options::default()).unwrap().0 else {
        panic!()
    };
    back.transform(Mat3::IDENTITY, 0.001);
    assert_eq!((back.markers.start, back.bodies.rate), (0.5, 120.0));
    for (a, b) in back.markers.tracks.iter().zip(&take.markers.tracks) {
        assert_eq!((&a.name, a.gaps()), (&b.name, b.gaps()));
        let pairs = a.samples.iter().zip(&b.samples);
        assert!(pairs.flat_map(|(a, b)| a.zip(*b)).all(|(a, b)| a.distance(b) < 1e-5));
    }
    // A byte for the largest.
    let residuals = back.markers.tracks[0].residuals.iter().zip([0.0, 0.001, 0.0005]);
    assert!(
        residuals.into_iter().all(|(a, b)| (a - b).abs() < 0.001 / 255.0),
        "{:?}",
        back.markers.tracks[0]
    );
    for (a, b) in back.bodies.tracks[0].samples.iter().zip(&take.bodies.tracks[0].samples) {
        assert_eq!(a.is_some(), b.is_some());
        if let (Some(a), Some(b)) = (a, b) {
            assert!(a.position.distance(b.position) < 1e-6 && a.rotation.dot(b.rotation).abs() > 1.0 - 1e-6);
        }
    }
    take.bodies.rate = 90.0;
    let uneven = write(&take, Path::new("a.c3d")).unwrap_err().to_string();
    assert!(uneven.contains("so many frames of bodies for each"), "{uneven}");
}
