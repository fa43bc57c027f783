//! A font with Japanese characters: one that the system has.

use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use yugen_archive::{Error, read_bounded};
use yugen_ink::signature::Font;

/// Most bytes of a font; collections of all Chinese, Japanese and Korean characters have 20 MB.
const MOST: u64 = 128 << 20;

/// Fonts of systems without fontconfig, and where it leaves them.
const KNOWN: &[(&str, u32)] = &[
    ("/System/Library/Fonts/ヒラギノ角ゴシック W3.ttc", 0),
    ("/System/Library/Fonts/Hiragino Sans GB.ttc", 0),
    ("C:/Windows/Fonts/YuGothR.ttc", 0),
    ("C:/Windows/Fonts/meiryo.ttc", 0),
    ("C:/Windows/Fonts/msgothic.ttc", 0),
    ("/usr/share/fonts/opentype/noto/NotoSansCJK-Regular.ttc", 0),
    ("/usr/share/fonts/opentype/ipafont-gothic/ipag.ttf", 0),
];

/// The best that is found.
pub fn japanese() -> Option<Font> {
    let found =
        of_fontconfig().into_iter().chain(KNOWN.iter().map(|(file, index)| (file.to_string(), *index)));
    found
        .filter(|(file, _)| Path::new(file).is_file())
        .find_map(|(file, index)| read(Path::new(&file), index).ok())
}

/// A font of a file.
pub fn read(file: &Path, index: u32) -> Result<Font, Error> {
    let bytes = read_bounded(file, MOST)?;
    Ok(Font { name: file.display().to_string(), bytes: Arc::new(bytes), index })
}

/// What fontconfig knows, upright and without serifs first.
fn of_fontconfig() -> Vec<(String, u32)> {
    let ask = Command::new("fc-list")
        .args(["--format", "%{file}\t%{index}\t%{family}\t%{style}\n", ":lang=ja"])
        .stderr(Stdio::null())
        .output();
    let text = ask.map(|o| String::from_utf8_lossy(&o.stdout).into_owned()).unwrap_or_default();
    ranked(&text)
}

fn ranked(list: &str) -> Vec<(String, u32)> {
    let mut all: Vec<(u32, String, u32)> = list
        .lines()
        .filter_map(|line| {
            let mut parts = line.split('\t');
            let (file, index, family, style) = (parts.next()?, parts.next()?, parts.next()?, parts.next()?);
            // What is above are instances of variable fonts.
            let index = index.parse::<u32>().ok()? & 0xffff;
            let kind = match family {
                f if f.contains("Mono") => 4,
                f if f.contains("Sans") && f.contains("JP") => 0,
                f if f.contains("Gothic") || f.contains("ゴシック") => 1,
                f if f.contains("Sans") => 2,
                _ => 5,
            };
            let upright = u32::from(!style.split(',').any(|s| s == "Regular"));
            Some((10 * upright + kind, file.to_string(), index))
        })
        .collect();
    all.sort();
    all.into_iter().map(|(_, file, index)| (file, index)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn upright_fonts_without_serifs_come_first() {
        let list = "/a/serif.ttc\t0\tNoto Serif CJK JP\tRegular\n/a/bold.ttc\t0\tNoto Sans CJK JP\tBold\n\
                    /a/sans.ttc\t65536\tNoto Sans CJK JP\tRegular\n/a/mono.ttc\t3\tNoto Sans Mono CJK JP\tRegular\n\
                    /a/ipag.ttf\t0\tIPAGothic,IPAゴシック\tRegular\nbroken\n/a/x\tnot a number\tx\ty\n";
        let names: Vec<String> =
            ranked(list).into_iter().map(|(file, index)| format!("{file}:{index}")).collect();
        assert_eq!(
            names,
            ["/a/sans.ttc:0", "/a/ipag.ttf:0", "/a/mono.ttc:3", "/a/serif.ttc:0", "/a/bold.ttc:0"]
        );
    }
}
