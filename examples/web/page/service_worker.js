// SPDX-License-Identifier: MIT
// Adds the headers that shared memory needs to the page's own files, and keeps those files for use offline.

const kBuild = "BUILD"; // of the contents, written by build.mjs
const kFiles = ["FILES"];
const kPrefix = `trephine ${self.registration.scope} `; // other pages of the host keep theirs
const kCache = kPrefix + kBuild;

self.addEventListener("install", (event) => {
  const fresh = kFiles.map((file) => new Request(file, { cache: "no-cache" }));
  event.waitUntil(caches.open(kCache).then((cache) => cache.addAll(fresh)));
});

self.addEventListener("activate", (event) => {
  const old = (names) => names.filter((name) => name.startsWith(kPrefix) && name !== kCache);
  event.waitUntil(
    caches.keys().then((names) => Promise.all(old(names).map((name) => caches.delete(name)))).then(() => self.clients.claim()),
  );
});

// A page that has just been opened asks for the newer build.
self.addEventListener("message", (event) => {
  if (event.data === "take over") self.skipWaiting();
});

function isolated(response) {
  if (response.status === 0) return response; // a redirection, which the browser follows
  const headers = new Headers(response.headers);
  headers.set("Cross-Origin-Opener-Policy", "same-origin");
  headers.set("Cross-Origin-Embedder-Policy", "require-corp");
  headers.set("Cross-Origin-Resource-Policy", "same-origin");
  return new Response(response.body, { status: response.status, statusText: response.statusText, headers });
}

self.addEventListener("fetch", (event) => {
  const { request } = event;
  const url = new URL(request.url);
  if (request.method !== "GET" || !url.href.startsWith(self.registration.scope)) return;
  const name = url.href.slice(self.registration.scope.length).replace(/[?#].*$/, "") || "index.html";
  const answer = async () => {
    const kept = kFiles.includes(name) ? await (await caches.open(kCache)).match(name) : undefined;
    return isolated(kept ?? (await fetch(request)));
  };
  event.respondWith(answer());
});
