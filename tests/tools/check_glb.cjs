// Runs Khronos's glTF validator on a file and prints its counts as JSON.
// usage: node check_glb.cjs FILE      (exit 3 when the package gltf-validator is not installed)
const fs = require("fs");

let validator;
try {
  validator = require("gltf-validator");
} catch {
  process.exit(3);
}
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2]))).then((report) => {
  console.log(JSON.stringify({ ...report.issues, info: undefined }));
});
