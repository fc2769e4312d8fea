//! The oracle: what becomes of a link (Hanrahan, Salzman & Aupperle 1991).

use glam::DVec2;

/// What is known of a link before it is made, at the receiver's sample points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Mean of the unoccluded point form factors.
    pub form_factor: f64,
    /// Mean of the visible ones.
    pub visible: f64,
    /// Change of the visible form factor per metre along the receiver's u and v, of the plane that fits best.
    pub gradient: DVec2,
    /// How far the visible form factor strays from that plane, extrapolated from the sample points to the receiver's
    /// corners.
    pub deviation: f64,
}

/// What is known of the two ends of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ends {
    /// Luminance of the source's radiosity, W·m⁻².
    pub radiosity: f64,
    /// How far the radiosity of the source's leaves strays from it, luminance, W·m⁻².
    pub deviation: f64,
    /// Whether the receiver is large enough to be divided.
    pub receiver_divides: bool,
    /// Whether the source has been divided.
    pub source_divided: bool,
}

/// A decision about a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refinement {
    /// Good enough as it is.
    Keep,
    /// Links to the receiver's children instead.
    DivideReceiver,
    /// Links from the source's children instead.
    DivideSource,
}

/// Decides by the irradiance, W·m⁻², that the link may misplace: over the receiver B·ΔF, over the source ΔB·F. A link
/// carries light that is linear over the receiver and constant over the source, so ΔF counts from a plane, ΔB from
/// the mean.
pub fn decide(estimate: &Estimate, ends: &Ends, link_error: f64) -> Refinement {
    let over_receiver = ends.radiosity * estimate.deviation;
    let over_source = ends.deviation * estimate.visible;
    let receiver = over_receiver > link_error && ends.receiver_divides;
    let source = over_source > link_error && ends.source_divided;
    match (receiver, source) {
        (true, true) if over_source > over_receiver => Refinement::DivideSource,
        (true, _) => Refinement::DivideReceiver,
        (false, true) => Refinement::DivideSource,
        (false, false) => Refinement::Keep,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_larger_error_is_divided_first_and_only_where_it_can_be() {
        let estimate = Estimate { form_factor: 0.5, visible: 0.2, deviation: 0.1, ..Estimate::default() };
        let ends = Ends { radiosity: 10.0, deviation: 20.0, receiver_divides: true, source_divided: true };
        assert_eq!(decide(&estimate, &ends, 0.5), Refinement::DivideSource);
        assert_eq!(decide(&estimate, &Ends { deviation: 3.0, ..ends }, 0.5), Refinement::DivideReceiver);
        assert_eq!(decide(&estimate, &Ends { source_divided: false, ..ends }, 0.5), Refinement::DivideReceiver);
        assert_eq!(decide(&estimate, &Ends { receiver_divides: false, ..ends }, 0.5), Refinement::DivideSource);
        assert_eq!(decide(&estimate, &ends, 4.0), Refinement::Keep);
        assert_eq!(decide(&estimate, &Ends { radiosity: f64::NAN, ..ends }, 4.0), Refinement::Keep);
    }
}
