// Bundles the viewer and three.js into one script, the same bytes each time.
// NODE_PATH=.../node_modules node build.js FILE
const fs = require("node:fs");
const path = require("node:path");
const esbuild = require("esbuild");

const modules = process.env.NODE_PATH;
const licence = fs.readFileSync(path.join(modules, "three", "LICENSE"), "utf8");

esbuild.buildSync({
  entryPoints: [path.join(__dirname, "viewer.js")],
  outfile: process.argv[2],
  nodePaths: [modules],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  charset: "ascii",
  legalComments: "none", // the whole licence stands in front
  banner: { js: `/*! This script contains three.js.\n\n${licence.trim()}\n*/` },
});
