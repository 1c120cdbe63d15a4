//! What the table of systems has wrong of shifts to WGS 84, and how far those may be off that it has right, by the
//! EPSG code of the geographic system, or of a system itself: of transformations to WGS 84 that the EPSG registry has.

/// Shifts that the registry has in a better form than the table of systems: three parameters, or seven with rotations
/// of position vectors.
const BETTER: [(u32, &str); 9] = [
    // Stereo 70 of Romania: EPSG:15995, whose rotations of the frame the table takes for those of position vectors.
    (3844, "2.329,-147.042,-92.08,-0.309,0.325,0.497,5.69"),
    // Israel: the table has three parameters, 10 m off.
    (4141, ISRAEL),
    // Pampa del Castillo: EPSG:9259 in the place of one that is 250 m off.
    (4161, "-233.43,6.65,173.64"),
    // Tananarive: EPSG:6873, good to 3 m, in the place of one of which that is not known.
    (4297, "-198.383,-240.517,-107.909"),
    // Yacare: EPSG:5386, good to 1.5 m, in the place of one of which that is not known.
    (4309, "-124.45,183.74,44.64,-0.4384,0.5446,-0.9706,-2.1365"),
    // St. Lucia: EPSG:6897 in the place of one that is 19 m off.
    (4606, "-153,153,307"),
    // Fatu Iva: EPSG:8842 in the place of EPSG:15772, which had its rotations the other way and was withdrawn.
    (4688, "347.175,1077.618,2623.677,33.9058,-70.6776,9.4013,186.0647"),
    // MGI from Ferro: EPSG:1618, as the table has it for MGI from Greenwich.
    (4805, "577.326,90.129,463.919,5.137,1.474,5.297,2.4232"),
    // Israel's grid of 2005 and 2012: the table has none, as if there were nothing to shift.
    (6990, ISRAEL),
];
/// EPSG:9676, and EPSG:9189 the other way.
const ISRAEL: &str = "23.772,17.49,17.859,-0.3132,-1.85274,1.67299,-5.4262";
/// On ellipsoids of WGS 84 or GRS 80, and on datums of their own all the same: intermediate systems of Israel's grid.
const UNKNOWN: [u32; 1] = [6983];

/// A definition with the better shift where there is one.
///
/// # Errors
/// In words, where none is known.
pub(super) fn corrected(definition: String, code: u32, geographic: Option<u32>) -> Result<String, String> {
    let is = |of: u32| of == code || geographic == Some(of);
    if UNKNOWN.into_iter().any(is) {
        return Err("on a datum without a known shift to WGS 84".into());
    }
    let Some((_, shift)) = BETTER.iter().find(|(of, _)| is(*of)) else { return Ok(definition) };
    let kept: Vec<&str> = definition.split_whitespace().filter(|word| !word.starts_with("+towgs84=")).collect();
    Ok(format!("{} +towgs84={shift}", kept.join(" ")))
}

/// What a person should know of the shift of a geographic system.
pub(super) fn remark(geographic: Option<u32>) -> String {
    let off_m = geographic.and_then(|code| OFF_M.iter().find(|(_, of)| of.contains(&code))).map(|(off_m, _)| *off_m);
    let how = match off_m {
        None => "good to some metres".to_owned(),
        Some(0) => "and how good they are is not known: it may be off by a hundred metres".to_owned(),
        Some(off_m) => format!("which may be off by up to {off_m} m"),
    };
    format!("its datum is shifted to WGS 84 by a few parameters, {how}")
}

/// Metres by which the shift of a geographic system may be off, where that is more than ten: what the registry says of
/// its accuracy, and how far it lies off the most accurate one of a part of the ground; 0 where that is not known.
const OFF_M: &[(u32, &[u32])] = &[
    (0, &[4145, 4219, 4255, 4257, 4304, 4613, 4646, 4715, 4804, 4820, 6881, 6882]),
    (15, &[3906, 4194, 4213, 4223, 4245, 4265, 4307, 4311, 5233, 5451, 5561]),
    (20, &[4129, 4154, 4204, 4208, 4230, 4232, 4263, 4298, 4713]),
    (25, &[4146, 4155, 4165, 4220, 4239, 4247]),
    (30, &[4168, 4175, 4236, 4251, 4315, 4672, 4716]),
    (35, &[4244, 4271, 4293, 4618, 4714, 4744]),
    (40, &[4135, 4210, 4736]),
    (
        45,
        &[
            4127, 4131, 4169, 4184, 4205, 4254, 4256, 4262, 4270, 4282, 4604, 4615, 4616, 4626, 4684, 4707, 4708, 4709,
            4711, 4712, 4719, 4722, 4724, 4725, 4727, 4728, 4729, 4730, 4733, 4734, 4735, 6883, 6894,
        ],
    ),
    (50, &[4748, 4806]),
    (65, &[4209, 4253]),
    (80, &[4248]),
    (95, &[4144]),
    (165, &[4630]),
    (195, &[4240]),
];
