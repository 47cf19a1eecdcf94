// Before anything is drawn: a dim room is not lit up while the page is on its way. A file, because the policy allows no other script.
{
  const kept = localStorage.getItem("kata-scheme");
  const dark = kept === "dark" || (kept !== "light" && matchMedia("(prefers-color-scheme: dark)").matches);
  document.documentElement.dataset.mantineColorScheme = dark ? "dark" : "light";
}
