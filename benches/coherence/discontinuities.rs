//! The discontinuities of a bake as visible lines (Guo 1998, section 4.4, hopes for shadow edges): what they gain.
//! `-- discontinuities`.

use glam::DVec3;
use renderer::{Eye, Filter, VisibleLine, object_edges, visible_lines};
use scene::{Bvh, Exposure};
use solver::{Gather, SolveOptions, Surroundings};

use crate::common;
use crate::pictures::{Compared, SUPERSAMPLE, columns, errors, refined};
use crate::point_gather::PointGather;

/// Side of the pictures, pixels.
const SIDE: u32 = 256;

/// Shares of the work image's pixels that pictures are made of.
const SHARES: [f64; 4] = [0.03, 0.04, 0.06, 0.08];

/// Scenes and their exposure values.
const SCENES: [(&str, f32); 2] = [("office", 2.0), ("gallery", -3.5)];

/// Prints the part of the page.
pub fn run() {
    for (name, exposure) in SCENES {
        let file = common::scratch("coherence.hlf");
        common::bake(name, &["--bounces", "0", "--tolerance", "0.05"], &file);
        let baked = formats::read_baked(&file).unwrap();
        let solution = solver::solve(&baked.scene, &SolveOptions { link_error: None, bounces: Some(0) }, &|_| {});
        let surroundings = Surroundings::new(&baked.scene, &solution);
        let gather = Gather::new(&surroundings, &solution);
        let points = PointGather::new(&baked.scene, &solution, &gather);
        let bvh = Bvh::of_scene(&baked.scene);
        let eye = Eye::new(&baked.scene, &bvh, baked.scene.cameras[0].camera, SIDE, SIDE);
        let edges = visible_lines(&eye, &object_edges(&eye));
        let discontinuities: Vec<[DVec3; 2]> =
            baked.lines.iter().map(|line| line.ends.map(|end| end.as_dvec3())).collect();
        let all = [&edges[..], &visible_lines(&eye, &discontinuities)].concat();
        let picture = |lines: &[VisibleLine], share: f64| {
            let most = (share * f64::from(SIDE * SUPERSAMPLE).powi(2)).round() as usize;
            let compared = Compared { exposure: Exposure { ev: exposure }, curve: None };
            let evaluate = |point| eye.diffuse(point, |seen| (points.irradiance(seen), 0));
            refined(lines, SIDE, most, compared, &evaluate).map.picture(Filter::Gaussian, None)
        };
        let full = picture(&edges, 1.0);
        println!("## {name}, direct light, with the {} discontinuities of its bake\n", discontinuities.len());
        println!("{SIDE} × {SIDE} pixels of 3 × 3.\n");
        println!("| share | without: L1 | L2 | with them: L1 | L2 |\n|---|---|---|---|---|");
        for share in SHARES {
            let of_both = [&edges, &all].map(|lines| errors(&picture(lines, share), &full));
            println!("| {:.1} % | {} |", 100.0 * share, columns(&of_both));
        }
        println!();
    }
}
