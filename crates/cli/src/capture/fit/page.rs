//! The report of a fit as a page: what was found, with a scale beside every picture.

use super::report::{Comparison, ERRORS, Report};
use crate::figure::chart::{Across, Chart};
use crate::figure::curve::{Curve, Look};
use crate::figure::scale::Scale;
use crate::figure::{CURVES, Colour, Figure};
use anyhow::Result;
use std::fmt::Write;
use yugen_capture::fit::Kind;
use yugen_capture::fit::compare::{IN_DEGREES, NAMES, SURE, Step, UNDECIDED, WRONG};

/// A picture with what it shows in two languages, and its key.
struct Shown {
    file: String,
    name: [&'static str; 2],
    text: [String; 2],
    key: Key,
}

/// What values of a picture mean.
enum Key {
    /// Black and white, in a unit.
    Greys([String; 2]),
    Colours(Vec<(Colour, [&'static str; 2])>),
    None,
}

/// Colours of the kinds, in the order of [`Kind::ALL`].
pub fn colour(kind: Kind) -> Colour {
    match kind {
        Kind::Nothing => [0; 3],
        Kind::Ground => CURVES[0],
        Kind::Both => CURVES[2],
        Kind::Highlight => CURVES[4],
    }
}

fn kind_name(kind: Kind) -> [&'static str; 2] {
    match kind {
        Kind::Nothing => ["nothing: masked or too few readings", "なし（マスク、または測定不足）"],
        Kind::Ground => ["a ground without a highlight", "拡散反射のみ"],
        Kind::Both => ["a ground and a highlight", "拡散反射と鏡面反射"],
        Kind::Highlight => ["a highlight over next to no ground: metal", "ほぼ鏡面反射のみ（金属）"],
    }
}

fn pictures(report: &Report) -> Vec<Shown> {
    let plain = |file: &str, name, text: [&str; 2], key| Shown {
        file: format!("{file}.png"),
        name,
        text: text.map(String::from),
        key,
    };
    let greys = |low: &str, high: &str| Key::Greys([low.to_string(), high.to_string()]);
    let kinds = Kind::ALL.map(|k| (colour(k), kind_name(k))).to_vec();
    let mut all = vec![
        plain(
            "diffuse",
            ["Ground", "拡散反射色"],
            ["Albedo ρ_d of the ground, as a colour.", "拡散反射率 ρ_d。"],
            Key::None,
        ),
        plain(
            "specular",
            ["Highlight", "鏡面反射色"],
            ["Albedo ρ_s of the highlight, as a colour.", "鏡面反射率 ρ_s。"],
            Key::None,
        ),
        plain(
            "normal",
            ["Normal", "法線"],
            [
                "(n + 1)/2: red grows to the right, green upwards; straight towards the camera is (.5, .5, 1).",
                "(n + 1)/2。赤は右、緑は上、正面は (.5, .5, 1)。",
            ],
            Key::None,
        ),
        plain(
            "tangent",
            ["Direction", "糸の向き"],
            [
                "(t + 1)/2 of the line along which the highlight is widest.",
                "ハイライトが最も広がる向き t の (t + 1)/2。",
            ],
            Key::None,
        ),
        plain(
            "sigma",
            ["Widths", "ハイライトの幅"],
            [
                "σ along the direction in red and across it in green: slopes of the half vector, 1 is 45°.",
                "赤は糸に沿った幅 σ、緑は直交する幅（ハーフベクトルの傾き、1 = 45°）。",
            ],
            greys("0", "1"),
        ),
        plain(
            "kinds",
            ["What texels are made of", "画素の種類"],
            ["Decided texel by texel from the readings.", "測定値から画素ごとに判定。"],
            Key::Colours(kinds),
        ),
        plain(
            "confidence",
            ["Confidence", "信頼度"],
            [
                &format!(
                    "What the readings can decide: above {SURE} a texel should be right, below {UNDECIDED} it is undecided."
                ),
                &format!("測定値で決まる度合い。{SURE} 以上は信頼でき、{UNDECIDED} 未満は未定。"),
            ],
            greys("0", "1"),
        ),
        plain(
            "residual",
            ["Residual", "残差"],
            [
                "Model less readings, root mean square over the readings' standard deviation.",
                "モデルと測定値の差（標準偏差単位の二乗平均平方根）。",
            ],
            greys("0", "10 σ"),
        ),
    ];
    for i in report.comparison.iter().flat_map(Comparison::drawn) {
        let (name, white) = (NAMES[i], ERRORS[i].white);
        let high = if IN_DEGREES[i] { format!("{white}°") } else { format!("{:.0} %", 100.0 * white) };
        all.push(Shown {
            file: format!("error_{name}.png"),
            name: ERRORS[i].title,
            text: [
                "Against the truth; what could not be compared is blue.",
                "真値との差。比較できない画素は青。",
            ]
            .map(String::from),
            key: Key::Greys(["0".into(), high]),
        });
    }
    all
}

/// Texels by their confidence.
pub fn histogram(confidence: &[f32]) -> Figure {
    const BARS: usize = 20;
    let mut counts = [0usize; BARS];
    for c in confidence {
        counts[((c * BARS as f32) as usize).min(BARS - 1)] += 1;
    }
    let percent = |n: usize| 100.0 * n as f32 / confidence.len().max(1) as f32;
    // As steps: what is counted is flat within a bar.
    let points = counts
        .iter()
        .enumerate()
        .flat_map(|(i, n)| [i, i + 1].map(|edge| (edge as f32 / BARS as f32, percent(*n))));
    let top = counts.iter().copied().map(percent).fold(1.0, f32::max);
    let chart = Chart {
        heading: vec!["Texels by confidence".into()],
        across: across_confidence(),
        upwards: "percent of texels".into(),
        scale: Scale::Linear,
        top,
        marks: Vec::new(),
        posts: vec![(UNDECIDED, "undecided below"), (SURE, "sure above")],
    };
    chart.draw(&[Curve { name: "texels".into(), look: Look::nth(0), points: points.collect(), peak: None }])
}

fn across_confidence() -> Across {
    Across { label: "confidence".into(), low: 0.0, high: 1.0, step: 0.1, unit: "" }
}

/// By how much normals were off, over their confidence.
pub fn calibration(steps: &[Step]) -> Figure {
    let curve = |i: usize, name: &str, value: &dyn Fn(&Step) -> f32| Curve {
        name: name.into(),
        look: Look::nth(i),
        points: steps.iter().map(|s| (s.confidence, value(s))).collect(),
        peak: None,
    };
    let curves = [curve(0, "mean", &|s| s.mean), curve(1, "nine in ten are below", &|s| s.ninety)];
    let top = curves.iter().flat_map(|c| &c.points).map(|p| p.1).fold(1.0, f32::max);
    Chart {
        heading: vec![format!("By how much normals are off; broken line: {WRONG}°")],
        across: across_confidence(),
        upwards: "degrees".into(),
        // From hundredths of a degree to tens, without decades in which there is nothing.
        scale: Scale::Cbrt,
        top,
        marks: vec![WRONG].into_iter().filter(|m| *m < top).collect(),
        posts: vec![(SURE, "sure above")],
    }
    .draw(&curves)
}

const STYLE: &str = "body{font:16px/1.5 system-ui,'Noto Sans JP',sans-serif;margin:2rem auto;max-width:76rem;padding:0 1rem;\
color:#2d3036;background:#fff}h1{font-size:1.5rem}h2{font-size:1.2rem;margin-top:2.2rem}\
.maps{display:grid;grid-template-columns:repeat(auto-fill,minmax(20rem,1fr));gap:1.5rem}figure{margin:0}\
.maps img{width:100%;image-rendering:pixelated;border:1px solid #cdd0d6}figcaption{font-size:.9rem}\
.key{display:flex;align-items:center;gap:.5rem;font-size:.85rem}.key i{flex:1;height:.8rem;border:1px solid #cdd0d6;\
background:linear-gradient(90deg,#000,#fff)}.kinds{list-style:none;padding:0;margin:.2rem 0;font-size:.85rem}\
.kinds b{display:inline-block;width:.9rem;height:.9rem;margin-right:.4rem;vertical-align:-.1rem}\
table{border-collapse:collapse}td,th{border:1px solid #cdd0d6;padding:.2rem .7rem;text-align:right}\
th:first-child,td:first-child{text-align:left}[lang=ja]{color:#5a5f68}img.chart{max-width:100%}";

/// The page itself; pictures and charts lie beside it.
pub fn html(report: &Report) -> Result<String> {
    let mut page = String::new();
    let title = escaped(&report.output.display().to_string());
    write!(
        page,
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>{title}</title><style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n"
    )?;
    for line in report.sentences() {
        let mut letters = line.chars();
        let first = letters.next().into_iter().flat_map(char::to_uppercase);
        let line: String = first.chain(letters).collect();
        writeln!(page, "<p>{}.</p>", escaped(&line))?;
    }
    if let Some(errors) = report.comparison.as_ref().and_then(Comparison::table) {
        let heads: String = ERRORS.iter().map(|e| format!("<th>{}</th>", e.head)).collect();
        writeln!(
            page,
            "<h2>Against the truth <span lang=\"ja\">真値との比較</span></h2>\n<table><tr><th></th>{heads}</tr>"
        )?;
        for (name, row) in errors {
            let cells: String = row.iter().map(|v| format!("<td>{}</td>", escaped(v))).collect();
            writeln!(page, "<tr><td>{name}</td>{cells}</tr>")?;
        }
        writeln!(page, "</table>")?;
    }
    writeln!(
        page,
        "<h2>Confidence <span lang=\"ja\">信頼度</span></h2>\n<p><img class=\"chart\" src=\"confidence.svg\" alt=\"Texels \
         by confidence\"></p>"
    )?;
    if let Some(compared) = &report.comparison {
        writeln!(
            page,
            "<p><img class=\"chart\" src=\"calibration.svg\" alt=\"By how much normals are off over confidence\"></p>\n<table>\
             <tr><th>confidence</th><th>texels</th><th>mean</th><th>90 % below</th><th>off by more than {WRONG}°</th></tr>"
        )?;
        for s in &compared.calibration {
            writeln!(
                page,
                "<tr><td>{:.2}</td><td>{}</td><td>{:.2}°</td><td>{:.2}°</td><td>{:.2} %</td></tr>",
                s.confidence,
                s.texels,
                s.mean,
                s.ninety,
                100.0 * s.wrong
            )?;
        }
        writeln!(page, "</table>")?;
    }
    writeln!(page, "<h2>Maps <span lang=\"ja\">マップ</span></h2>\n<div class=\"maps\">")?;
    for shown in pictures(report) {
        let Shown { file, name: [name, ja], text: [text, text_ja], key } = shown;
        writeln!(
            page,
            "<figure><a href=\"{file}\"><img src=\"{file}\" alt=\"{name}\"></a><figcaption><strong>{name} <span \
             lang=\"ja\">{ja}</span></strong><br>{text}<br><span lang=\"ja\">{text_ja}</span></figcaption>"
        )?;
        match key {
            Key::Greys([low, high]) => writeln!(page, "<div class=\"key\">{low}<i></i>{high}</div>")?,
            Key::Colours(colours) => {
                write!(page, "<ul class=\"kinds\">")?;
                for ([r, g, b], [name, ja]) in colours {
                    write!(
                        page,
                        "<li><b style=\"background:rgb({r},{g},{b})\"></b>{name} <span lang=\"ja\">{ja}</span></li>"
                    )?;
                }
                writeln!(page, "</ul>")?;
            }
            Key::None => {}
        }
        writeln!(page, "</figure>")?;
    }
    writeln!(page, "</div>\n</body></html>")?;
    Ok(page)
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
