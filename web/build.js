// Bundles the scripts of pages with the packages that they use, the same bytes each time.
// NODE_PATH=.../node_modules node build.js FOLDER
const fs = require("node:fs");
const path = require("node:path");
const zlib = require("node:zlib");
const esbuild = require("esbuild");

const modules = process.env.NODE_PATH;
const folder = process.argv[2];
const license = fs.readFileSync(path.join(modules, "three", "LICENSE"), "utf8");

const common = {
  nodePaths: [modules],
  bundle: true,
  minify: true,
  target: "es2022",
  charset: "ascii",
  legalComments: "none", // the whole license stands in front
  banner: { js: `/*! This script contains three.js.\n\n${license.trim()}\n*/` },
};
const bundled = (name, options) =>
  esbuild.buildSync({
    ...common,
    ...options,
    entryPoints: [path.join(__dirname, name)],
    outfile: path.join(folder, name),
  });

bundled("viewer.js", { format: "iife" });
// Node's modules, which MuJoCo's script imports where it runs in Node.
bundled("play.js", { format: "esm", external: ["module", "node:*"] });

const engine = fs.readFileSync(path.join(modules, "@mujoco", "mujoco", "mujoco.wasm"));
fs.writeFileSync(path.join(folder, "mujoco.wasm.zlib"), zlib.deflateSync(engine, { level: 9 }));
