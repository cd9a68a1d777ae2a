import { createHash } from "node:crypto";
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { defineConfig, type Plugin } from "vite";

/** Files besides those of `src` and `public` that the bundle is made from. */
const SOURCES = ["index.html", "package-lock.json", "package.json", "tsconfig.json", "vite.config.ts"];

function files(folder: string): string[] {
  const entries = readdirSync(folder, { withFileTypes: true });
  return entries.flatMap((entry) => (entry.isDirectory() ? files(join(folder, entry.name)) : [join(folder, entry.name)]));
}

/** Writes the digest of all sources beside the bundle, so that a test sees whether it is of these sources. */
function digest(): Plugin {
  return {
    name: "digest",
    generateBundle() {
      const hash = createHash("sha256");
      for (const file of [...files("src"), ...files("public"), ...SOURCES].sort()) {
        hash.update(`${file}\n`).update(readFileSync(file));
      }
      this.emitFile({ type: "asset", fileName: "SOURCES", source: `${hash.digest("hex")}\n` });
    },
  };
}

// Fixed names: the server has a table of these files.
export default defineConfig({
  plugins: [digest()],
  worker: { format: "es", rollupOptions: { output: { entryFileNames: "stream.js" } } },
  build: {
    target: "es2022",
    assetsInlineLimit: 0,
    modulePreload: false,
    rollupOptions: {
      output: { entryFileNames: "console.js", assetFileNames: "console[extname]" },
    },
  },
});
