//! Prints the features of the built-in terrain as lines of text, or draws them as an SVG with `--svg`.
//! `cargo run -p sample-terrain --example map -- 1 0 0 50000 50000`

use std::time::Instant;

use sample_terrain::{SampleShape, features, heights};
use terrain::{PostRect, Post, Spacing};
use std::io::Write;

fn main() {
    let n: Vec<f64> = std::env::args().skip(1).map(|a| a.parse().unwrap()).collect();
    let t = Instant::now();
    let found = features(n[0] as u64, n[1], n[2], n[3], n[4]);
    eprintln!("{} features in {:?}", found.len(), t.elapsed());
    for f in &found {
        let tags: Vec<String> = f.tags.iter().map(|(k,v)| format!("{k}={v}")).collect();
        let pts = match &f.shape { SampleShape::Line(l) => l.clone(), SampleShape::Polygon(r) => r[0].clone() };
        let pts: Vec<String> = pts.iter().map(|p| format!("{:.3} {:.3}", p[0], p[1])).collect();
        println!("{}|{}|{}", f.id, tags.join(","), pts.join(","));
    }
    if n.len() > 5 {
        let m = n[5];
        let r = PostRect::new(Post::new((n[2]/m) as i32, (n[1]/m) as i32), Post::new((n[4]/m) as i32, (n[3]/m) as i32));
        let dem = heights(n[0] as u64, r, Spacing::from_metres(m).unwrap());
        let mut f = std::io::BufWriter::new(std::fs::File::create("/tmp/sample/dem.bin").unwrap());
        for row in r.south..=r.north { for h in dem.row(row) { f.write_all(&h.to_le_bytes()).unwrap(); } }
    }
}
