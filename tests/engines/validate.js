// Khronos' validator on every file of a folder: no error, no warning. node validate.js FOLDER
const fs = require("fs");
const path = require("path");
const validator = require("gltf-validator");

async function main(folder) {
  const files = fs.readdirSync(folder).filter((name) => name.endsWith(".glb")).sort();
  let bad = files.length ? 0 : 1;
  for (const name of files) {
    const bytes = new Uint8Array(fs.readFileSync(path.join(folder, name)));
    const { issues } = await validator.validateBytes(bytes, { maxIssues: 20 });
    if (issues.numErrors || issues.numWarnings) {
      bad += 1;
      console.log(name, JSON.stringify(issues.messages.slice(0, 3)));
    }
  }
  console.log(`${files.length} files, ${bad} with errors or warnings`);
  process.exit(bad ? 1 : 0);
}

main(process.argv[2]);
