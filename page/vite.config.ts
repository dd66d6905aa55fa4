import { defineConfig } from "vite";
import { viteSingleFile } from "vite-plugin-singlefile";

/** One file, into which Python puts the core and the description of a drive. */
export default defineConfig({
  plugins: [viteSingleFile({ removeViteModuleLoader: true })],
  build: { outDir: "../build/page", emptyOutDir: true, target: "es2022", reportCompressedSize: false },
  logLevel: "warn",
});
