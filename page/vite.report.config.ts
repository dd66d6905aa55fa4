import { defineConfig } from "vite";

/** The script of reports, which Python puts into each of them. */
export default defineConfig({
  build: {
    outDir: "../build/report",
    emptyOutDir: true,
    target: "es2022",
    reportCompressedSize: false,
    lib: { entry: "src/report.ts", formats: ["iife"], name: "report", fileName: () => "report.js" },
  },
  logLevel: "warn",
});
