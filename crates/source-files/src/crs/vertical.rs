//! The unit of a vertical coordinate system, by its EPSG code, as the EPSG registry defines it.

/// Metres in a foot.
pub(crate) const FOOT_M: f64 = 0.3048;
/// Metres in a US survey foot.
pub(crate) const US_FOOT_M: f64 = 1200.0 / 3937.0;
/// Metres in the foot that Great Britain measured by in 1936.
const BRITISH_FOOT_1936_M: f64 = 0.304_800_749_1;

/// Codes of heights in metres, first and last of each run; at the end three of systems of three dimensions, which
/// files name in this place, too.
const METRES: &[(u16, u16)] = &[
    (3855, 3855),
    (3886, 3886),
    (3900, 3900),
    (4440, 4440),
    (4458, 4458),
    (5193, 5193),
    (5195, 5195),
    (5214, 5214),
    (5237, 5237),
    (5317, 5317),
    (5597, 5597),
    (5600, 5611),
    (5613, 5613),
    (5615, 5621),
    (5701, 5701),
    (5703, 5705),
    (5709, 5714),
    (5716, 5733),
    (5735, 5738),
    (5740, 5753),
    (5755, 5788),
    (5790, 5799),
    (5829, 5829),
    (5843, 5843),
    (5868, 5872),
    (5874, 5874),
    (5941, 5941),
    (6178, 6187),
    (6638, 6644),
    (6647, 6647),
    (6693, 6695),
    (6916, 6916),
    (7446, 7447),
    (7651, 7652),
    (7699, 7700),
    (7707, 7707),
    (7832, 7832),
    (7837, 7837),
    (7839, 7839),
    (7841, 7841),
    (7888, 7890),
    (7962, 7962),
    (7968, 7968),
    (7979, 7979),
    (8089, 8089),
    (8266, 8267),
    (8357, 8357),
    (8434, 8434),
    (8675, 8675),
    (8690, 8691),
    (8841, 8841),
    (8881, 8881),
    (8904, 8904),
    (8911, 8911),
    (9130, 9130),
    (9245, 9245),
    (9255, 9255),
    (9274, 9274),
    (9279, 9279),
    (9303, 9303),
    (9335, 9335),
    (9351, 9351),
    (9389, 9390),
    (9392, 9402),
    (9451, 9451),
    (9458, 9458),
    (9471, 9471),
    (9650, 9651),
    (9663, 9663),
    (9666, 9666),
    (9669, 9669),
    (9675, 9675),
    (9681, 9681),
    (9721, 9722),
    (9923, 9923),
    (9927, 9927),
    (10190, 10190),
    (10352, 10354),
    (10482, 10485),
    (10565, 10565),
    (10588, 10588),
    (20000, 20000),
    (20034, 20036),
    (4979, 4979),
    (4937, 4937),
    (6319, 6319),
];
const FEET: [u16; 5] = [6130, 6131, 6132, 8050, 8228];
const US_FEET: [u16; 3] = [5702, 6360, 8052];
const BRITISH_FEET_1936: [u16; 1] = [5754];
/// Codes of depths, which count downwards.
const DEPTHS: &[(u16, u16)] = &[
    (5336, 5336),
    (5612, 5612),
    (5614, 5614),
    (5706, 5706),
    (5715, 5715),
    (5734, 5734),
    (5739, 5739),
    (5789, 5789),
    (5831, 5831),
    (5861, 5867),
    (5873, 5873),
    (6357, 6359),
    (7976, 7976),
    (8051, 8051),
    (8053, 8053),
    (8358, 8358),
    (8378, 8378),
    (8897, 8897),
    (9287, 9288),
    (9672, 9672),
    (10150, 10151),
    (10349, 10349),
    (10364, 10364),
    (10370, 10379),
    (10547, 10552),
    (10649, 10650),
    (10678, 10678),
];

/// Metres in a unit of heights of the system with an EPSG code.
///
/// # Errors
/// In words, what is wrong with it, when the code is not known or is one of depths.
pub(crate) fn unit_m(code: u16) -> Result<f64, String> {
    let lies_in = |runs: &[(u16, u16)]| runs.iter().any(|&(first, last)| (first..=last).contains(&code));
    match () {
        () if lies_in(METRES) => Ok(1.0),
        () if FEET.contains(&code) => Ok(FOOT_M),
        () if US_FEET.contains(&code) => Ok(US_FOOT_M),
        () if BRITISH_FEET_1936.contains(&code) => Ok(BRITISH_FOOT_1936_M),
        () if lies_in(DEPTHS) => Err(format!("depths, which count downwards (vertical system EPSG:{code})")),
        () => Err(format!("the unit of a vertical system of code {code}, which is not known")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_of_a_vertical_system_is_that_of_its_definition() {
        for (code, unit_m) in [(5703, 1.0), (5773, 1.0), (3855, 1.0), (5702, US_FOOT_M), (6360, US_FOOT_M)] {
            assert_eq!(super::unit_m(code), Ok(unit_m), "{code}");
        }
        for code in [6130, 6131, 8228] {
            assert_eq!(unit_m(code), Ok(FOOT_M), "{code}");
        }
        assert!(unit_m(5715).unwrap_err().contains("downwards"));
        assert!(unit_m(5103).unwrap_err().contains("not known"), "a datum, which has no unit");
    }
}
