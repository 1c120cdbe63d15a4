//! What heights are measured from: the names of vertical datums, by the EPSG codes of vertical systems.
//!
//! Systems that differ in their unit only have one name. A code without a name here is a name of its own, so that no
//! two datums are taken for one because they are not known.

use super::vertical::unit_m;

/// Systems of well-known datums.
const SYSTEMS: &[(u16, &str)] = &[
    (3855, "EGM2008"),
    (3900, "N2000"),
    (4440, "NZVD2009"),
    (5195, "Trieste"),
    (5214, "Genoa 1942"),
    (5317, "FVR09"),
    (5608, "IGLD 1955"),
    (5609, "IGLD 1985"),
    (5610, "HVRS71"),
    (5611, "Caspian"),
    (5613, "RH2000"),
    (5621, "EVRF2007"),
    (5701, "ODN"),
    (5702, "NGVD29"),
    (5703, "NAVD88"),
    (5704, "Yellow Sea 1956"),
    (5705, "Baltic 1977"),
    (5709, "NAP"),
    (5710, "Ostend"),
    (5711, "AHD"),
    (5712, "AHD (Tasmania)"),
    (5713, "CGVD28"),
    (5716, "Piraeus"),
    (5717, "N60"),
    (5718, "RH70"),
    (5719, "NGF Lallemand"),
    (5720, "NGF-IGN69"),
    (5721, "NGF-IGN78"),
    (5723, "JSLD69"),
    (5728, "LN02"),
    (5729, "LHN95"),
    (5730, "EVRF2000"),
    (5731, "Malin Head"),
    (5732, "Belfast"),
    (5733, "DNN"),
    (5735, "Black Sea"),
    (5736, "Yellow Sea 1956"),
    (5737, "Yellow Sea 1985"),
    (5738, "HKPD"),
    (5754, "Poolbeg"),
    (5773, "EGM96"),
    (5774, "NG95"),
    (5775, "Antalya"),
    (5776, "NN54"),
    (5778, "GHA"),
    (5779, "SVS2000"),
    (5780, "Cascais"),
    (5781, "Constanta"),
    (5782, "Alicante"),
    (5783, "DHHN92"),
    (5784, "DHHN85"),
    (5785, "SNN76"),
    (5787, "EOMA 1980"),
    (5798, "EGM84"),
    (5799, "DVR90"),
    (5941, "NN2000"),
    (6360, "NAVD88"),
    (6641, "PRVD02"),
    (6642, "VIVD09"),
    (6643, "ASVD02"),
    (6644, "GUVD04"),
    (6647, "CGVD2013"),
    (6694, "JGD2000"),
    (6695, "JGD2011"),
    (7699, "DHHN12"),
    (7700, "Latvia 2000"),
    (7837, "DHHN2016"),
    (7839, "NZVD2016"),
    (7962, "Poolbeg"),
    (7968, "NGVD29"),
    (8089, "ISH2004"),
    (8228, "NAVD88"),
    (8357, "Baltic 1957"),
    (8675, "N43"),
    (8690, "SVS2010"),
    (9279, "SA LLD"),
    (9389, "EVRF2019"),
    (9458, "AVWS"),
    (9651, "EVRF2007-PL"),
    (9663, "EH2000"),
    (9666, "LAS07"),
    (9669, "BGS2005"),
];
/// Heights above the ellipsoid: systems of three dimensions on WGS 84 and ETRS89, and what GeoTIFF of version 1.0 calls
/// vertical systems of the ellipsoids GRS 80 and WGS 84.
const ELLIPSOIDAL: [u16; 4] = [4937, 4979, 5019, 5030];
/// Heights and depths of the sea, wherever that is: no datum that could be compared.
const SEA_LEVEL: [u16; 6] = [5714, 5715, 8050, 8051, 8052, 8053];
/// Codes of datums, which GeoTIFF of version 1.0 takes for those of systems; and each one's system.
const DATUMS: &[(u16, u16)] = &[
    (1027, 3855),
    (5100, 5714),
    (5101, 5701),
    (5102, 5702),
    (5103, 5703),
    (5104, 5736),
    (5105, 5705),
    (5106, 5611),
    (5109, 5709),
    (5110, 5710),
    (5111, 5711),
    (5112, 5712),
    (5171, 5773),
    (5203, 5798),
];
/// Names of well-known texts that are no datum's with `height` behind it, without what is not a letter or a digit.
const OTHER_NAMES: [(&str, &str); 4] =
    [("egm2008geoid", "EGM2008"), ("egm96geoid", "EGM96"), ("navd1988", "NAVD88"), ("ngvd1929", "NGVD29")];
/// Code of what a file spells out by itself.
const USER_DEFINED: u32 = 32767;

/// The datum of the vertical system with an EPSG code; `None` where the code stands for none, or for sea level.
pub(crate) fn datum_of_system(code: u32) -> Option<String> {
    let is_in = |codes: &[u16]| codes.iter().any(|&known| u32::from(known) == code);
    match code {
        0 | USER_DEFINED => None,
        _ if is_in(&SEA_LEVEL) => None,
        _ if is_in(&ELLIPSOIDAL) => Some("ellipsoid".into()),
        5100..=5112 => datum_of_code(code),
        _ => {
            let name = SYSTEMS.iter().find(|(known, _)| u32::from(*known) == code).map(|(_, name)| (*name).to_owned());
            Some(name.unwrap_or_else(|| format!("EPSG:{code}")))
        }
    }
}

/// The datum with an EPSG code of its own, as [`datum_of_system`] names it.
pub(crate) fn datum_of_code(code: u32) -> Option<String> {
    match DATUMS.iter().find(|(datum, _)| u32::from(*datum) == code) {
        Some(&(_, system)) => datum_of_system(system.into()),
        None if matches!(code, 0 | USER_DEFINED) => None,
        None => Some(format!("EPSG datum {code}")),
    }
}

/// The datum that the name of a vertical system is made of, as `NAVD88 height (ftUS)` is of NAVD88.
pub(super) fn datum_in_name(name: &str) -> Option<String> {
    let plain = plain(name.split_once("height").map_or(name, |(before, _)| before));
    let own = SYSTEMS.iter().map(|(_, name)| *name).find(|name| self::plain(name) == plain);
    let other = || OTHER_NAMES.iter().find(|(other, _)| *other == plain).map(|(_, name)| *name);
    own.or_else(other).map(str::to_owned)
}

/// The EPSG code of heights in metres above a datum of a well-known name.
pub fn vertical_code(datum: &str) -> Option<u16> {
    let wanted = plain_datum(datum);
    let is_it = |&&(code, name): &&(u16, &str)| plain(name) == wanted && unit_m(code) == Ok(1.0);
    SYSTEMS.iter().find(is_it).map(|(code, _)| *code)
}

/// A datum's name without what people write differently: `EGM 96` is `egm96`, and so is `EPSG:5773`.
pub fn plain_datum(name: &str) -> String {
    let plain = plain(name);
    let code = plain.strip_prefix("epsg").and_then(|code| code.parse().ok());
    code.and_then(datum_of_system).map_or(plain, |name| self::plain(&name))
}

fn plain(name: &str) -> String {
    name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(codes: &[u32], expected: Option<&str>) {
        for &code in codes {
            assert_eq!(datum_of_system(code).as_deref(), expected, "{code}");
        }
    }

    #[test]
    fn systems_of_one_datum_have_one_name_and_unknown_ones_a_name_of_their_own() {
        check(&[5703, 6360, 8228, 5103], Some("NAVD88"));
        check(&[5702, 7968, 5102], Some("NGVD29"));
        check(&[5773], Some("EGM96"));
        check(&[4979, 5030], Some("ellipsoid"));
        check(&[5714, 8050, 8052, 5100, 0, 32767], None);
        check(&[5760], Some("EPSG:5760"));
        assert_eq!([5171, 5181].map(datum_of_code), [Some("EGM96".into()), Some("EPSG datum 5181".into())]);
    }

    #[test]
    fn tables_are_in_order_and_every_system_has_a_unit() {
        assert!(SYSTEMS.is_sorted_by_key(|(code, _)| code) && DATUMS.is_sorted());
        assert!(SYSTEMS.iter().all(|&(code, _)| unit_m(code).is_ok()));
    }

    #[test]
    fn a_datum_is_the_same_by_name_and_by_code() {
        for [one, other] in [["EPSG:6360", "NAVD 88"], ["epsg:5773", "EGM96"], ["EPSG:5720", "NGF IGN69"]] {
            assert_eq!(plain_datum(one), plain_datum(other));
        }
        assert_ne!(plain_datum("EPSG:5760"), plain_datum("EPSG:5761"));
        let codes = ["NAVD88", "NGVD29", "EPSG:6360", "Poolbeg", "ellipsoid", "mine"].map(vertical_code);
        assert_eq!(codes, [Some(5703), Some(7968), Some(5703), Some(7962), None, None]);
        let names = ["NAVD88 height (ftUS)", "EGM2008_Geoid", "DHHN2016_height", "Hoehe ueber alles"];
        let found = names.map(|name| datum_in_name(name).unwrap_or_default());
        assert_eq!(found, ["NAVD88", "EGM2008", "DHHN2016", ""]);
    }
}
