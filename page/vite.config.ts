import { defineConfig } from "vite";
import { viteSingleFile } from "vite-plugin-singlefile";

/** One file, into which Python puts the core and the description of a drive. */
export default defineConfig({
  // What the page takes from outside its folder.
  resolve: { alias: { "lostmotion-style": new URL("../src/lostmotion/reports/style.css", import.meta.url).pathname } },
  plugins: [viteSingleFile({ removeViteModuleLoader: true })],
  build: { outDir: "../build/page", emptyOutDir: true, target: "es2022", reportCompressedSize: false },
  logLevel: "warn",
});
