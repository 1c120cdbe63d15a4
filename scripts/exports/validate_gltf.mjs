// Validates glTF files with Khronos' validator: no error and no warning may be found.
// Usage: node validate_gltf.mjs FILE.glb…
import { readFileSync } from "node:fs";
import validator from "gltf-validator";

let faults = 0;
for (const path of process.argv.slice(2)) {
  const report = await validator.validateBytes(new Uint8Array(readFileSync(path)), { maxIssues: 20 });
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  faults += numErrors + numWarnings;
  if (0 < numErrors + numWarnings || process.argv.length <= 4) {
    console.log(`${path}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos, ${numHints} hints`);
    messages.filter((message) => message.severity <= 1).forEach((message) => console.log("  ", message));
  }
}
console.log(`${process.argv.length - 2} files, ${faults} errors and warnings`);
process.exit(faults === 0 ? 0 : 1);
