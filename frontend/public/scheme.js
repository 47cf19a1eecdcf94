// Sets the colour scheme before the first paint, so that a dark room is not lit up while the page loads.
// A separate file, because the content security policy allows no inline scripts.
{
  const stored = localStorage.getItem("kata-scheme");
  const dark =
    stored === "dark" || (stored !== "light" && matchMedia("(prefers-color-scheme: dark)").matches);
  document.documentElement.dataset.mantineColorScheme = dark ? "dark" : "light";
}
