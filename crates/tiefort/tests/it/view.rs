//! `tiefort view`: the server, or word of how to build it in.

use crate::scene::Scene;

#[cfg(not(feature = "viewer"))]
#[test]
fn without_the_viewer_the_command_says_how_to_build_it_in() {
    let scene = Scene::new();
    scene.refuses(&["view", "small.tdb"], &["without the viewer"]);
    let hint = scene.run_to(2, &["view", "small.tdb"]).stderr;
    assert!(hint.contains("scripts/build_viewer.sh") && hint.contains("--features viewer"), "{hint}");
}

#[cfg(feature = "viewer")]
mod server {
    use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
    use std::net::TcpStream;
    use std::process::{Child, Stdio};
    use std::time::{Duration, Instant};

    use serde_json::Value;

    use super::Scene;
    use crate::raster::Raster;

    /// A server, ended with the test.
    struct Server {
        process: Child,
        host: String,
        scene: Scene,
    }

    impl Drop for Server {
        fn drop(&mut self) {
            let _ = self.process.kill();
            let _ = self.process.wait();
        }
    }

    fn served() -> Server {
        let scene = Scene::with_job("small.toml", &[]);
        scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html"]);
        served_in(scene, "small.tdb")
    }

    fn served_in(scene: Scene, folder: &str) -> Server {
        let mut process =
            scene.program().args(["view", folder]).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let host = line.trim().strip_prefix("http://").unwrap().trim_end_matches('/').to_owned();
        Server { process, host, scene }
    }

    impl Server {
        /// Status and body of an answer to a request for `path` under the name `host`.
        fn asked_as(&self, host: &str, path: &str) -> (u16, Vec<u8>) {
            let mut stream = TcpStream::connect(&self.host).unwrap();
            write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
            let mut answer = Vec::new();
            stream.read_to_end(&mut answer).unwrap();
            let end = answer.windows(4).position(|four| four == b"\r\n\r\n").unwrap();
            let head = String::from_utf8(answer[..end].to_vec()).unwrap();
            (head.split(' ').nth(1).unwrap().parse().unwrap(), answer[end + 4..].to_vec())
        }

        fn asked(&self, path: &str) -> (u16, Vec<u8>) {
            self.asked_as(&self.host, path)
        }
    }

    #[test]
    fn roads_without_triangles_of_their_own_are_given_load_module_by_load_module() {
        let scene = Scene::with_job("small.toml", &[]);
        let job = std::fs::read_to_string(scene.path("job.toml")).unwrap();
        std::fs::write(scene.path("job.toml"), format!("{job}\n[features]\nsources = [\"sample\"]\n")).unwrap();
        scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html"]);
        let server = served_in(scene, "small.tdb");
        let area: Value = serde_json::from_slice(&server.asked("/api/area").1).unwrap();
        assert_eq!(area["has_lines"], true);
        let (status, lines) = server.asked("/api/lines/0/0/8/8");
        assert!(status == 200 && !lines.is_empty() && lines.len() % 40 == 0);
        let part = server.asked("/api/lines/2/0/3/8").1;
        assert!(part.len() < lines.len());
        for edge in lines.chunks(40) {
            let word = |at: usize| u32::from_le_bytes(edge[4 * at..4 * at + 4].try_into().unwrap());
            let metres = |at: usize| f64::from(f32::from_bits(word(at)));
            let module = |at: usize| ((metres(at) + metres(at + 3)) / 2.0 / 500.0) as u32;
            assert_eq!((word(0), word(1)), (module(5), module(4)), "row and column");
            assert!(word(2) < area["classes"].as_array().unwrap().len() as u32);
        }
        assert_eq!(part.chunks(40).count(), lines.chunks(40).filter(|edge| edge[0] == 2).count());
    }

    #[test]
    fn the_server_hands_out_the_page_the_area_and_its_load_modules() {
        let server = served();
        let (status, page) = server.asked("/");
        assert!(status == 200 && page.starts_with(b"<!doctype html>"));
        assert!(server.asked("/viewer.js").1.len() > 100_000);
        let area: Value = serde_json::from_slice(&server.asked("/api/area").1).unwrap();
        assert_eq!((&area["rows"], &area["cols"]), (&8.into(), &8.into()));
        let steps = area["coarse_steps"].as_u64().unwrap() as usize;
        let (_, overview) = server.asked("/api/overview");
        let places = (8 * steps + 1).pow(2);
        assert_eq!(overview.len(), 4 * places + 16 * 64 + places);
        // The class at each height, by which water is blue far away and on the map, too: all of it is mountains here.
        assert!(overview[overview.len() - places..].iter().all(|&class| class == 1));
        let triangles = |place: usize| {
            let at = overview.len() - places - 16 * (64 - place);
            u32::from_le_bytes(overview[at..at + 4].try_into().unwrap())
        };
        assert_eq!(u64::from((0..64).map(triangles).sum::<u32>()), area["triangles"].as_u64().unwrap());
        let (status, block) = server.asked("/api/modules/2/3/4/5");
        let word = |place: usize| u32::from_le_bytes(block[4 * place..4 * place + 4].try_into().unwrap());
        assert_eq!((status, word(0), word(1), word(3)), (200, 2, 3, triangles(2 * 8 + 3)));
        assert_eq!(server.asked("/api/dem"), (200, br#"{"why":null}"#.to_vec()));
        let (status, posts) = server.asked("/api/dem/2/3/4/5");
        assert_eq!((status, posts.len()), (200, 8 * 41 * 41));
    }

    #[test]
    fn the_tools_of_the_page_answer_as_the_commands_do() {
        let server = served();
        let value = |path: &str| {
            let (status, body) = server.asked(path);
            let text = String::from_utf8(body).unwrap();
            assert_eq!(status, 200, "{path}: {text}");
            serde_json::from_str::<Value>(&text).unwrap()
        };
        let line = value("/api/sight/506000,3875500,1/508500,3878500,1");
        let words = ["sight", "small.tdb", "--from", "506000,3875500,1", "--to", "508500,3878500,1"];
        let said = server.scene.run_to(0, &words).stdout;
        let clearance = format!("clearance  {:.2} m", line["clearance_m"].as_f64().unwrap());
        assert!(line["visible"] == false && said.starts_with("hidden") && said.contains(&clearance), "{line}: {said}");
        let (status, seen) = server.asked("/api/viewshed/507000,3876500,20/1/1800/50");
        assert_eq!((status, seen.len(), &seen[..4]), (200, 8 + 73 * 73, &73u32.to_le_bytes()[..]));
        assert!(seen[8..].iter().all(|kind| [0, 1, 255].contains(kind)));
        let profile = value("/api/profile/100/506000,3876000/507000,3876000");
        assert_eq!(profile["height_m"].as_array().unwrap().len(), 11);
        assert_eq!(value("/api/find/506000%203876000")["place_m"], serde_json::json!([506_000.0, 3_876_000.0]));
        let near = value("/api/find/11S%20506000%203876000");
        assert!((near["place_m"][1].as_f64().unwrap() - 3_876_000.0).abs() < 1e-3, "{near}");
        let globe = value("/api/where/506000,3876000");
        let [latitude, longitude] = ["latitude", "longitude"].map(|name| globe[name].as_f64().unwrap());
        let back = value(&format!("/api/find/{latitude},{longitude}"));
        assert!((back["place_m"][0].as_f64().unwrap() - 506_000.0).abs() < 0.01, "{back}");
        for wrong in [
            "/api/sight/1,2,3/4,5,6",
            "/api/viewshed/507000,3876500,20/1/900000/1",
            "/api/viewshed/507000,3876500,20/1/0/1",
            "/api/profile/0/506000,3876000/507000,3876000",
            "/api/find/nowhere",
            "/api/find/11X%201%202",
        ] {
            assert_eq!(server.asked(wrong).0, 409, "{wrong}");
        }
        let (status, relief) = server.asked("/api/relief");
        assert_eq!((status, relief.len()), (200, 20 + 3 * 161 * 161));
    }

    #[test]
    fn without_its_raster_a_database_is_served_and_says_that_there_is_no_dem() {
        let scene = Scene::with_job("raster.toml", &[]);
        Raster::sound().write(&scene.path("dem.tif"));
        scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html", "--out", "a.tdb"]);
        std::fs::rename(scene.path("dem.tif"), scene.path("gone.tif")).unwrap();
        let server = served_in(scene, "a.tdb");
        assert_eq!(server.asked("/api/modules/0/0/1/1").0, 200);
        let ground: Value = serde_json::from_slice(&server.asked("/api/dem").1).unwrap();
        assert!(ground["why"].as_str().unwrap().contains("dem.tif"), "{ground}");
        let (status, why) = server.asked("/api/dem/0/0/1/1");
        assert!(status == 409 && String::from_utf8(why).unwrap().contains("dem.tif"));
    }

    /// Longer than a client may take for its request, on a busy machine.
    const ENOUGH: Duration = Duration::from_secs(40);

    #[test]
    fn slow_clients_neither_keep_others_waiting_nor_stay() {
        let server = served();
        let begun = |text: &str| {
            let mut stream = TcpStream::connect(&server.host).unwrap();
            stream.set_read_timeout(Some(ENOUGH)).unwrap();
            stream.write_all(text.as_bytes()).unwrap();
            stream
        };
        let texts = ["", "G", "GET / HTTP/1.1\r\nHost: ", "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nA: "];
        let mut clients: Vec<TcpStream> = (0..400).map(|i| begun(texts[i % texts.len()])).collect();
        let start = Instant::now();
        assert_eq!(server.asked("/api/area").0, 200);
        assert!(start.elapsed() < Duration::from_secs(3), "an answer after {:?}", start.elapsed());
        // The newest client sends on, a byte at a time; it is ended as the others are.
        let last = clients.last_mut().unwrap();
        last.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
        let is_open = |stream: &mut TcpStream| {
            let read = stream.write_all(b"a").and_then(|()| stream.read(&mut [0; 256]));
            // Nothing to read within the time; an answer, an end or an error is an end.
            matches!(read, Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut))
        };
        while is_open(last) {
            assert!(start.elapsed() < ENOUGH, "a slow client is still connected");
        }
        for client in &mut clients {
            let mut rest = Vec::new();
            let waited = matches!(client.read_to_end(&mut rest), Err(error) if error.kind() == ErrorKind::WouldBlock);
            assert!(!waited, "a client that sends nothing is still connected");
        }
    }

    #[test]
    fn clients_that_do_not_read_make_place_for_others() {
        let server = served();
        let ask = || {
            let mut stream = TcpStream::connect(&server.host).unwrap();
            // More answers than sockets hold, none of them read.
            let requests = format!("GET /viewer.js HTTP/1.1\r\nHost: {}\r\n\r\n", server.host).repeat(20);
            stream.write_all(requests.as_bytes()).unwrap();
            stream
        };
        let clients: Vec<TcpStream> = (0..100).map(|_| ask()).collect();
        let start = Instant::now();
        assert_eq!(server.asked("/api/area").0, 200);
        assert!(start.elapsed() < Duration::from_secs(3), "an answer after {:?}", start.elapsed());
        drop(clients);
    }

    #[test]
    fn a_request_that_is_too_long_is_refused() {
        let server = served();
        let mut stream = TcpStream::connect(&server.host).unwrap();
        stream.set_read_timeout(Some(ENOUGH)).unwrap();
        let long = "a".repeat(1 << 16);
        // The server may end the connection before all is sent.
        let _ = write!(stream, "GET / HTTP/1.1\r\nHost: {}\r\nA: {long}\r\n\r\n", server.host);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        assert!(!answer.starts_with(b"HTTP/1.1 200"), "{}", String::from_utf8_lossy(&answer));
        assert_eq!(server.asked("/api/area").0, 200);
    }

    #[test]
    fn what_cannot_be_answered_is_told_in_words() {
        let server = served();
        for wrong in ["/api/modules/2/3/2/5", "/api/modules/0/0/9/8", "/api/dem/0/0/8/9"] {
            let (status, why) = server.asked(wrong);
            assert!(status == 404 && String::from_utf8(why).unwrap().contains("of 8 x 8 load modules"), "{wrong}");
        }
        assert_eq!(server.asked("/api/modules/a/b/c/d").0, 400);
        assert_eq!(server.asked("/etc/passwd").0, 404);
        assert_eq!(server.asked_as("example.org", "/api/area").0, 403);
        let port = server.host.rsplit(':').next().unwrap();
        server.scene.refuses(&["view", "small.tdb", "--port", port], &[port, "cannot be served"]);
        server.scene.refuses(&["view", "none.tdb"], &["none.tdb"]);
    }
}
