//! KML 2.2 output of a plan: positions with altitudes above mean sea level, and the hops between them.

use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use super::feature::{Feature, Map, position};

const NAMESPACE: &str = "http://www.opengis.net/kml/2.2";

/// Colours by kind of feature, as alpha, blue, green and red.
const STYLES: [(&str, &str); 5] = [
    ("tx", "ff00a000"),
    ("rx", "ffa06000"),
    ("relay", "ffffffff"),
    ("interferer", "ff0000e0"),
    ("hop", "ff00d0ff"),
];

type Xml = Writer<Vec<u8>>;

/// Returns the text of a KML file with the given title.
///
/// # Errors
/// Those of the XML writer, which cannot fail in memory.
pub fn text(map: &Map, title: &str) -> io::Result<String> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 1);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    xml.create_element("kml")
        .with_attribute(("xmlns", NAMESPACE))
        .write_inner_content(|xml| {
            xml.create_element("Document").write_inner_content(|xml| {
                leaf(xml, "name", title)?;
                for (kind, color) in STYLES {
                    style(xml, kind, color)?;
                }
                for feature in &map.features {
                    placemark(xml, feature)?;
                }
                Ok(())
            })?;
            Ok(())
        })?;
    let mut text = String::from_utf8(xml.into_inner()).map_err(io::Error::other)?;
    text.push('\n');
    Ok(text)
}

/// Writes an element that contains only text.
fn leaf(xml: &mut Xml, name: &str, text: &str) -> io::Result<()> {
    xml.create_element(name)
        .write_text_content(BytesText::new(text))?;
    Ok(())
}

fn style(xml: &mut Xml, kind: &str, color: &str) -> io::Result<()> {
    xml.create_element("Style")
        .with_attribute(("id", kind))
        .write_inner_content(|xml| {
            xml.create_element("IconStyle")
                .write_inner_content(|xml| leaf(xml, "color", color))?;
            xml.create_element("LineStyle").write_inner_content(|xml| {
                leaf(xml, "color", color)?;
                leaf(xml, "width", "3")
            })?;
            Ok(())
        })?;
    Ok(())
}

fn placemark(xml: &mut Xml, feature: &Feature) -> io::Result<()> {
    let numbers = feature.numbers.iter();
    let numbers: Vec<String> = numbers.map(|(name, it)| format!("{name} = {it}")).collect();
    let at: Vec<String> = feature
        .at
        .iter()
        .map(|at| {
            let [lon, lat, amsl] = position(*at);
            format!("{lon:.7},{lat:.7},{amsl:.3}")
        })
        .collect();
    xml.create_element("Placemark").write_inner_content(|xml| {
        leaf(xml, "name", &feature.name)?;
        if !numbers.is_empty() {
            leaf(xml, "description", &numbers.join(", "))?;
        }
        leaf(xml, "styleUrl", &format!("#{}", feature.kind))?;
        let shape = if at.len() > 1 { "LineString" } else { "Point" };
        xml.create_element(shape).write_inner_content(|xml| {
            if shape == "Point" {
                // Draws a line down to the ground.
                leaf(xml, "extrude", "1")?;
            }
            leaf(xml, "altitudeMode", "absolute")?;
            leaf(xml, "coordinates", &at.join(" "))
        })?;
        Ok(())
    })?;
    Ok(())
}
