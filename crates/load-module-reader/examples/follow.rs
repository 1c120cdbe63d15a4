//! The example of the book (`docs/guides/simulators.md`): `follow DATABASE`.

use load_module_reader::{Area, Keep, ReadError, Sight};

/// Drives a tank over a database such as `mine.tdb`, and tells from where it sees a place.
pub fn follow(database: &str) -> Result<(), ReadError> {
    let area = Area::open(database, Keep::OnDisk)?;
    let mut tank = [506_125.0, 3_876_310.5];

    // 15 x 15 load modules around the tank: 3.5 km and more in every direction.
    let mut ground = area.load(area.block_around(tank, 7))?;
    for _ in 0..100 {
        tank[0] += 12.0;
        let block = area.block_around(tank, 7);
        if block != ground.block() {
            // Only what is new is read.
            ground = ground.moved(&area, block)?;
        }
        let Some(under) = ground.sample(tank) else { break };
        let eye = [tank[0], tank[1], under.height_m + 2.5];
        if ground.sight(eye, [507_000.0, 3_877_000.0, 1_500.0]) == Sight::Free {
            println!("{:.2} m, class {}: seen", under.height_m, under.class);
        }
    }
    Ok(())
}

fn main() -> Result<(), ReadError> {
    follow(&std::env::args().nth(1).unwrap_or("mine.tdb".into()))
}
