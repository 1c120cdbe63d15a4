// Where the program begins: as the page, or as what works beside it.
import { start } from "./main.js";
import { wrong } from "./panel.js";
import { work } from "./worker.js";

if (typeof document === "undefined") work();
else start().catch((fault) => wrong(`The area could not be shown: ${fault.message}`));
