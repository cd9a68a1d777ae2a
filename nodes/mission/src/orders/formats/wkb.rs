//! Well-known binary: the parts of a geometry as they are read.

use geozero::GeomProcessor;
use geozero::error::{GeozeroError, Result};

use super::super::feature::Part;
use crate::shapes::sphere::Place;

/// Deepest collection in a collection: what is deeper is nobody's, and would fill the stack.
const DEPTH_MAX: usize = 32;

/// Gathers the parts of a geometry.
#[derive(Debug, Default)]
pub(super) struct Parts {
    /// What was read so far.
    pub parts: Vec<Part>,
    line: Vec<Place>,
    rings: Vec<Vec<Place>>,
    in_area: bool,
    /// What no strip can come from is one part, whatever it is made of.
    in_other: usize,
    depth: usize,
}

impl Parts {
    fn other(&mut self, kind: &str) -> Result<()> {
        if self.in_other == 0 {
            self.parts.push(Part::Other(kind.to_owned()));
        }
        self.in_other += 1;
        Ok(())
    }

    fn other_ends(&mut self) -> Result<()> {
        self.in_other = self.in_other.saturating_sub(1);
        Ok(())
    }

    fn deeper(&mut self) -> Result<()> {
        self.depth += 1;
        let too_deep = || GeozeroError::Geometry(format!("collections are nested more than {DEPTH_MAX} deep"));
        if self.depth > DEPTH_MAX { Err(too_deep()) } else { Ok(()) }
    }

    fn back(&mut self) -> Result<()> {
        self.depth = self.depth.saturating_sub(1);
        Ok(())
    }
}

/// Kinds of geometry that are one part which is no strip.
macro_rules! others {
    ($($kind:literal: $begin:ident, $end:ident;)*) => {$(
        fn $begin(&mut self, _: usize, _: usize) -> Result<()> {
            self.deeper()?;
            self.other($kind)
        }

        fn $end(&mut self, _: usize) -> Result<()> {
            self.back()?;
            self.other_ends()
        }
    )*};
}

impl GeomProcessor for Parts {
    fn xy(&mut self, x: f64, y: f64, _: usize) -> Result<()> {
        self.line.push([x, y]);
        Ok(())
    }

    fn empty_point(&mut self, _: usize) -> Result<()> {
        self.other("Point")?;
        self.other_ends()
    }

    fn point_begin(&mut self, _: usize) -> Result<()> {
        self.other("Point")
    }

    fn point_end(&mut self, _: usize) -> Result<()> {
        self.other_ends()
    }

    fn linestring_begin(&mut self, _: bool, _: usize, _: usize) -> Result<()> {
        self.line.clear();
        Ok(())
    }

    fn linestring_end(&mut self, _: bool, _: usize) -> Result<()> {
        let line = std::mem::take(&mut self.line);
        if self.in_other > 0 {
            return Ok(());
        }
        if self.in_area {
            self.rings.push(line)
        } else {
            self.parts.push(Part::Line(line))
        }
        Ok(())
    }

    fn polygon_begin(&mut self, _: bool, _: usize, _: usize) -> Result<()> {
        self.in_area = true;
        Ok(())
    }

    fn polygon_end(&mut self, _: bool, _: usize) -> Result<()> {
        let rings = std::mem::take(&mut self.rings);
        self.in_area = false;
        if self.in_other == 0 {
            self.parts.push(Part::Area(rings));
        }
        Ok(())
    }

    fn geometrycollection_begin(&mut self, _: usize, _: usize) -> Result<()> {
        self.deeper()
    }

    fn geometrycollection_end(&mut self, _: usize) -> Result<()> {
        self.back()
    }

    others! {
        "MultiPoint": multipoint_begin, multipoint_end;
        "CircularString": circularstring_begin, circularstring_end;
        "CompoundCurve": compoundcurve_begin, compoundcurve_end;
        "CurvePolygon": curvepolygon_begin, curvepolygon_end;
        "MultiCurve": multicurve_begin, multicurve_end;
        "MultiSurface": multisurface_begin, multisurface_end;
        "PolyhedralSurface": polyhedralsurface_begin, polyhedralsurface_end;
        "TIN": tin_begin, tin_end;
    }

    fn triangle_begin(&mut self, _: bool, _: usize, _: usize) -> Result<()> {
        self.other("Triangle")
    }

    fn triangle_end(&mut self, _: bool, _: usize) -> Result<()> {
        self.other_ends()
    }
}
