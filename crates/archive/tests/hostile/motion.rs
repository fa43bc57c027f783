//! Files of motion.

use crate::{FILE, assault};
use glam::{Quat, Vec3};
use std::path::Path;
use yugen_archive::formats::motion::{
    Angles, Conventions, Motion, Options, acclaim, bvh, c3d, motive, qualisys, table, trc, vicon,
};
use yugen_motion::{RigidPose, Take, Track, Tracks};

type Read = fn(&[u8], &Path, &Options) -> Result<(Motion, Conventions), yugen_archive::Error>;

/// Whatever is read has as many samples as frames, a rate, and numbers.
fn sound(motion: &Motion) {
    fn even<T>(tracks: &Tracks<T>) {
        assert!(tracks.frames == 0 || tracks.rate > 0.0 && tracks.rate.is_finite());
        for track in &tracks.tracks {
            assert_eq!(track.samples.len(), tracks.frames);
            assert!(track.residuals.is_empty() || track.residuals.len() == tracks.frames);
        }
    }
    match motion {
        Motion::Captured(take) => {
            even(&take.markers);
            even(&take.bodies);
            let points = take.markers.tracks.iter().flat_map(|t| t.samples.iter().flatten());
            assert!(points.into_iter().all(|p| p.is_finite()));
            let poses = take.bodies.tracks.iter().flat_map(|t| t.samples.iter().flatten());
            assert!(poses.into_iter().all(|p| p.position.is_finite() && p.rotation.is_normalized()));
        }
        Motion::Skeletal(moved) => {
            let names = moved.skeleton.joints().len();
            assert!(moved.clip.channels.iter().all(|(joint, _)| *joint < names));
            let last = moved.frames.saturating_sub(1);
            assert!(moved.frames == 0 || moved.skeleton.to_skeleton(&moved.pose(last)).is_ok());
        }
    }
    let size = motion.size();
    assert!(size.height >= 0.0);
}

fn assault_reader(name: &str, seeds: &[Vec<u8>], read: Read) {
    let options = Options { rate: Some(50.0), angles: Some(Angles::Helical), ..Options::default() };
    assault(name, seeds, |b| match read(b, Path::new(FILE), &options) {
        Ok((motion, _)) => {
            sound(&motion);
            true
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    });
}

#[test]
fn hierarchies() {
    let seed = b"HIERARCHY\nROOT hips {\nOFFSET 0 98 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n\
        JOINT left knee\n{\nOFFSET 1 -40 0\nCHANNELS 3 Yrotation Xrotation Zrotation\nEnd Site\n{\nOFFSET 0 -40 5\n}\n}\n}\n\
        MOTION\nFrames: 2\nFrame Time: 0.00833333\n1 2 3 10 20 30 40 50 60\n4 5 6 -10 0 0 0 0 90\n";
    assault_reader("bvh", &[seed.to_vec()], bvh::read);
}

#[test]
fn rows_of_markers_and_bodies() {
    let seed = b"PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tNumFrames\tNumMarkers\tUnits\n120.00\t2\t2\tmm\n\
        Frame#\tTime\ttoe\t\t\theel\t\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t\n\n3\t0.016\t1\t2\t3\t4\t5\t6\t\n4\t0.025\t\t\t\t7\t8\t9\n";
    assault_reader("trc", &[seed.to_vec()], trc::read);
    let seed = b"Format Version,1.23,Export Frame Rate,120.0,Total Exported Frames,2,Rotation Type,Quaternion,Length Units,Meters\r\n\
        ,,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Marker,Marker,Marker\r\n\
        ,,a,a,a,a,a,a,a,a,toe,toe,toe\r\n,,I,I,I,I,I,I,I,I,J,J,J\r\n,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,\
        Mean Marker Error,Position,Position,Position\r\nFrame,Time,X,Y,Z,W,X,Y,Z,,X,Y,Z\r\n0,0,0.6,0,0,0.8,1,2,3,0.5,1,2,3\r\n1,.1,,,,,,,,,4,5,6\r\n";
    assault_reader("motive", &[seed.to_vec()], motive::read);
    let seed = b"Segments\n120\n,,head,,,,,\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\n,,deg,deg,deg,mm,mm,mm\n5,0,0,90,0,1,2,3\n6,0,,,,,,\n\n\
        Trajectories\n240\n,,toe,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n10,0,1,2,3\n11,0,,,\n";
    assault_reader("vicon", &[seed.to_vec()], vicon::read);
    let bodies = b"NO_OF_FRAMES\t2\nNO_OF_BODIES\t1\nFREQUENCY\t100\nDATA_INCLUDED\t6D\nBODY_NAMES\thead\nX\tY\tZ\n\
        1\t2\t3\t0\t0\t90\t0.25\t0\t1\t0\t-1\t0\t0\t0\t0\t1\n4\t5\t6\t0\t0\t0\t0.5\t1\t0\t0\t0\t1\t0\t0\t0\t1\n";
    let markers =
        b"NO_OF_FRAMES\t2\nNO_OF_MARKERS\t2\nFREQUENCY\t100\nDATA_INCLUDED\t3D\nMARKER_NAMES\ttoe\theel\n\
        1.5\t2\t3\t4\t5\t6\n0\t0\t0\t7\t8\t9\n";
    assault_reader("qualisys", &[bodies.to_vec(), markers.to_vec()], qualisys::read);
    let seed = b"# metres\nseconds,kind,name,x,y,z,qx,qy,qz,qw,residual\n0,marker,toe,1,2,3,,,,,0.5\n0,body,head,4,5,6,0.6,0,0,0.8,\n\
        0.5,marker,toe,,,,,,,,\n0.25,body,head,,,,,,,,\n0.5,body,head,1,1,1,0,0,0,1,\n";
    assault_reader("motion_table", &[seed.to_vec()], table::read);
}

#[test]
fn points_in_binary() {
    let pose = RigidPose { position: Vec3::ONE, rotation: Quat::from_rotation_y(1.0) };
    let marker =
        Track { name: "toe".into(), samples: vec![Some(Vec3::X), None], residuals: vec![0.001, 0.0] };
    let body = Track { name: "fan".into(), samples: vec![Some(pose); 2], residuals: Vec::new() };
    let take = Take {
        markers: Tracks { rate: 50.0, start: 0.0, frames: 2, tracks: vec![marker] },
        bodies: Tracks { rate: 50.0, start: 0.0, frames: 2, tracks: vec![body] },
    };
    let seed = c3d::write(&take, Path::new(FILE)).unwrap();
    assault_reader("c3d", &[seed], c3d::read);
}

const ASF: &[u8] = b":version 1.10\n:units\n mass 1\n length 0.45\n angle deg\n:root\n order TX TY TZ RX RY RZ\n axis XYZ\n position 0 0 0\n \
    orientation 0 0 0\n:bonedata\nbegin\nname thigh\ndirection 0 -2 0\nlength 7\naxis 0 0 20 XYZ\ndof rx rz\nend\nbegin\nname shin\n\
    direction 0 0 1\nlength 3\naxis 0 90 0 XYZ\ndof rx\nend\n:hierarchy\nbegin\nroot thigh\nthigh shin\nend\n";

#[test]
fn bones_and_their_angles() {
    assault_reader("asf", &[ASF.to_vec()], acclaim::read_still);
    let skeleton = acclaim::Acclaim::read(ASF, Path::new(FILE)).unwrap();
    let seed = b"# f\xfcr\n:FULLY-SPECIFIED\n:DEGREES\n1\nroot 1 2 3 10 20 30\nthigh 40 50\nshin 60\n2\nroot 4 5 6 0 0 0\nthigh 0 0\nshin 0\n";
    let options = Options { rate: Some(50.0), ..Options::default() };
    assault("amc", &[seed.to_vec()], |b| match skeleton.read_motion(b, Path::new(FILE), &options) {
        Ok(moved) => {
            sound(&Motion::Skeletal(moved));
            true
        }
        Err(e) => {
            assert!(e.to_string().contains(FILE), "{e}");
            false
        }
    });
}
