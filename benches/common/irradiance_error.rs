//! How far probed irradiance is from a table of data/reference/.

use std::path::Path;

use scene::Rgb;

/// A table with a header; lines that start with # are comments.
pub struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    pub fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).unwrap();
        let fields = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let mut lines = text.lines().filter(|line| !line.starts_with('#')).map(fields);
        Self { header: lines.next().unwrap(), rows: lines.collect() }
    }

    /// Three columns, a prefix and r, g, b; none where a field is empty.
    fn colours(&self, prefix: &str) -> Vec<Option<Rgb>> {
        let place = |colour: &str| self.header.iter().position(|name| *name == format!("{prefix}{colour}")).unwrap();
        let places = ["r", "g", "b"].map(place);
        let colour = |row: &Vec<String>| {
            let [r, g, b] = places.map(|place| row[place].parse().ok());
            Some(Rgb::new(r?, g?, b?))
        };
        self.rows.iter().map(colour).collect()
    }
}

/// Relative errors of all light over points spread by area: (E − truth) ÷ max(own, mean), where own is the point's
/// truth averaged over its colours and mean that average over all points.
pub struct ErrorOfPoints {
    /// Root of the mean square over points and colours, less the truth's own variance.
    pub rms: f64,
    /// 99th percentile over the points of the root mean square over the colours, each less its truth's variance.
    pub p99: f64,
}

impl ErrorOfPoints {
    /// Points that met no surface are left out, and may be one in two hundred.
    pub fn of(truth: &Table, probe: &Table) -> Self {
        let complete = |prefix: &str| truth.colours(prefix).into_iter().collect::<Option<Vec<Rgb>>>().unwrap();
        let (truths, deviations, probes) = (complete("E_"), complete("se_"), probe.colours("e"));
        assert_eq!(truths.len(), probes.len());
        let average = |colour: Rgb| colour.element_sum() / 3.0;
        let mean = truths.iter().copied().map(average).sum::<f64>() / truths.len() as f64;
        let mut squares = Vec::with_capacity(truths.len());
        for ((&truth, &deviation), probe) in truths.iter().zip(&deviations).zip(&probes) {
            let Some(probe) = *probe else { continue };
            let (difference, scale) = (probe - truth, average(truth).max(mean));
            squares.push(average(difference * difference - deviation * deviation) / (scale * scale));
        }
        assert!((truths.len() - squares.len()) * 200 <= truths.len(), "too many points met no surface");
        squares.sort_by(f64::total_cmp);
        let root = |square: f64| square.max(0.0).sqrt();
        let rms = root(squares.iter().sum::<f64>() / squares.len() as f64);
        Self { rms, p99: root(squares[(squares.len() - 1) * 99 / 100]) }
    }
}
