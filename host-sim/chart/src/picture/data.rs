//! A picture as data: for JSON, and for the script of a page that zooms and reads values.

use super::{Mark, Panel, Picture};
use crate::axis::Axis;
use crate::palette::Look;
use serde_json::{Value, json};

impl Picture {
    /// Panels with their positions (CSS pixels), axes and curves. A curve has the name of its look
    /// in the legend. Values have six figures.
    pub fn data(&self) -> Value {
        let panels = self.panels.iter().map(|panel| self.panel(panel));
        json!({ "size": [self.size.0, self.size.1], "panels": panels.collect::<Vec<_>>() })
    }

    fn panel(&self, panel: &Panel) -> Value {
        let curves = panel.marks.iter().filter_map(|mark| match mark {
            Mark::Line(points, look) => Some(json!({
                "name": self.name(*look),
                "colour": look.colour.name,
                "width": look.width,
                "dash": look.dash.map(|(on, off)| [on, off]),
                "points": rounded(points),
            })),
            Mark::Dots(points, radius, colour) => Some(json!({
                "name": self.named(|look| look.colour == *colour),
                "colour": colour.name,
                "radius": radius,
                "points": rounded(points),
            })),
            Mark::Signs(..) | Mark::Text(..) | Mark::Ends(_) => None,
        });
        json!({
            "at": [panel.at.0, panel.at.1],
            "size": [panel.size.0, panel.size.1],
            "title": panel.title.iter().filter(|t| !t.is_empty()).collect::<Vec<_>>(),
            "x": axis(&panel.x),
            "y": axis(&panel.y),
            "curves": curves.collect::<Vec<_>>(),
            "ends": panel.marks.iter().any(|mark| matches!(mark, Mark::Ends(_))),
        })
    }

    fn name(&self, look: Look) -> Option<&str> {
        self.named(|known| known == look)
    }

    fn named(&self, is: impl Fn(Look) -> bool) -> Option<&str> {
        let mut entries = self.legends.iter().flat_map(|legend| &legend.entries);
        let (name, _) = entries.find(|(_, look)| is(*look))?;
        Some(name)
    }
}

fn axis(axis: &Axis) -> Value {
    let (low, high) = axis.ends();
    json!({ "label": axis.label, "low": low, "high": high, "log": axis.is_log() })
}

/// Points with six figures; a gap is `null`.
fn rounded(points: &[(f64, f64)]) -> Vec<[Option<f64>; 2]> {
    let round = |x: f64| {
        format!("{x:.5e}")
            .parse()
            .ok()
            .filter(|x: &f64| x.is_finite())
    };
    points.iter().map(|(x, y)| [round(*x), round(*y)]).collect()
}
