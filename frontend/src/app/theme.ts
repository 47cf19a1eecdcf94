import { type CSSVariablesResolver, createTheme, localStorageColorSchemeManager } from "@mantine/core";
import { FIELDS } from "../lib/messages";

// Red, yellow and cyan are alarm colours (IEC 60601-1-8); nothing else wears them, but for Stop itself.
export const theme = createTheme({
  primaryColor: "indigo",
  primaryShade: 8,
  fontFamily:
    "system-ui, 'Segoe UI', Roboto, 'Noto Sans', 'Hiragino Sans', 'Yu Gothic UI', 'Noto Sans JP', 'Noto Sans CJK JP', sans-serif",
  defaultRadius: "md",
  components: {
    // Below the header, which keeps Stop in reach.
    // A press beside a dialog discards nothing.
    Modal: { defaultProps: { yOffset: 140, closeOnClickOutside: false } },
    // A link in a sentence is told by more than its colour (WCAG 1.4.1).
    Anchor: { defaultProps: { underline: "always" } },
    Button: { defaultProps: { size: "md" } },
    TextInput: { defaultProps: { size: "md" } },
    Select: { defaultProps: { size: "md" } },
    // A closed list is not there: it would be laid out, and its place worked out anew at each change of the page.
    Combobox: { defaultProps: { keepMounted: false } },
    // It names the button itself, in English only.
    PasswordInput: { defaultProps: { visibilityToggleButtonProps: { "aria-label": FIELDS.showPassword } } },
    Textarea: { defaultProps: { size: "md" } },
  },
});

/** Light, dark, or as the computer has it: kept by this browser. public/scheme.js reads it before anything is drawn. */
export const scheme = localStorageColorSchemeManager({ key: "kata-scheme" });

/** Mantine's own greys and links are too faint for some eyes; and what is ours has a name in both schemes. */
export const variables: CSSVariablesResolver = (given) => ({
  variables: {},
  light: {
    "--mantine-color-dimmed": given.colors.gray[7],
    "--mantine-color-placeholder": given.colors.gray[7],
    "--mantine-color-error": given.colors.grape[8],
    "--kata-brand": given.colors.indigo[9],
    "--kata-hover": given.colors.gray[1],
    "--kata-chosen": given.colors.indigo[0],
    "--kata-chosen-edge": given.colors.indigo[8],
    "--kata-quiet": given.colors.gray[2],
    "--kata-limb": given.colors.gray[5],
    "--kata-setpoint": TRACES.light.setpoint,
    "--kata-measured": TRACES.light.measured,
  },
  dark: {
    "--mantine-color-dimmed": given.colors.dark[1],
    "--mantine-color-placeholder": given.colors.dark[1],
    "--mantine-color-error": given.colors.grape[3],
    "--mantine-color-anchor": given.colors.indigo[3],
    "--mantine-primary-color-light-color": given.colors.indigo[2],
    "--mantine-color-indigo-light-color": given.colors.indigo[2],
    "--mantine-color-grape-light-color": given.colors.grape[2],
    "--mantine-color-gray-light-color": given.colors.gray[3],
    "--mantine-color-indigo-outline": given.colors.indigo[3],
    "--kata-brand": given.colors.indigo[2],
    "--kata-hover": given.colors.dark[6],
    "--kata-chosen": given.colors.dark[5],
    "--kata-chosen-edge": given.colors.indigo[3],
    "--kata-quiet": given.colors.dark[5],
    "--kata-limb": given.colors.dark[2],
    "--kata-setpoint": TRACES.dark.setpoint,
    "--kata-measured": TRACES.dark.measured,
  },
});

/** Traces: told apart by everybody, and none in an alarm colour. The figures of the service use the light ones. */
export const TRACES = {
  light: { setpoint: "#1f3a93", measured: "#e07b00" },
  dark: { setpoint: "#9db2ff", measured: "#ff9a3c" },
} as const;
