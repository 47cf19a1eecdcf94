import { type CSSVariablesResolver, createTheme, localStorageColorSchemeManager } from "@mantine/core";
import { t } from "../lib/i18n";

// Red, yellow and cyan are alarm colours (IEC 60601-1-8). Apart from alarms, only Stop uses one.
export const theme = createTheme({
  primaryColor: "indigo",
  primaryShade: 8,
  fontFamily:
    "system-ui, 'Segoe UI', Roboto, 'Noto Sans', 'Hiragino Sans', 'Yu Gothic UI', 'Noto Sans JP', 'Noto Sans CJK JP', sans-serif",
  defaultRadius: "md",
  // Dialogs and menus open at once for a user who has asked the system for less motion.
  respectReducedMotion: true,
  components: {
    // Dialogs open below the header, so that Stop stays reachable. Pressing outside a dialog does not close it.
    Modal: {
      defaultProps: {
        yOffset: "calc(var(--kata-header) + 1rem)",
        closeOnClickOutside: false,
        closeButtonProps: { "aria-label": t("ui:dialog.close") },
      },
    },
    // Links in text are underlined, because colour alone is not enough (WCAG 1.4.1).
    Anchor: { defaultProps: { underline: "always" } },
    Button: { defaultProps: { size: "md" } },
    TextInput: { defaultProps: { size: "md" } },
    Select: { defaultProps: { size: "md" } },
    // A closed list is unmounted, because a mounted one would be laid out and positioned again at each change of
    // the page.
    Combobox: { defaultProps: { keepMounted: false } },
    // Mantine has only an English name for this button.
    PasswordInput: {
      defaultProps: { visibilityToggleButtonProps: { "aria-label": t("common:fields.showPassword") } },
    },
    Textarea: { defaultProps: { size: "md" } },
  },
});

/**
 * The colour scheme (light, dark or the system's), stored in this browser. public/scheme.js reads it before
 * the first paint.
 */
export const scheme = localStorageColorSchemeManager({ key: "kata-scheme" });

/**
 * Mantine's default greys and links have too little contrast. Kata's own colours are defined in both schemes.
 */
export const variables: CSSVariablesResolver = (mantineTheme) => ({
  variables: {},
  light: {
    "--mantine-color-dimmed": mantineTheme.colors.gray[7],
    "--mantine-color-placeholder": mantineTheme.colors.gray[7],
    "--mantine-color-error": mantineTheme.colors.grape[8],
    "--kata-brand": mantineTheme.colors.indigo[9],
    "--kata-hover": mantineTheme.colors.gray[1],
    "--kata-chosen": mantineTheme.colors.indigo[0],
    "--kata-chosen-edge": mantineTheme.colors.indigo[8],
    "--kata-quiet": mantineTheme.colors.gray[2],
    "--kata-limb": mantineTheme.colors.gray[5],
    "--kata-stale": STALE.light,
    "--kata-control-edge": CONTROL_EDGE.light,
    "--kata-shadow": "0 0 0",
    "--kata-stage-1": mantineTheme.colors.gray[2],
    "--kata-stage-2": mantineTheme.colors.gray[4],
    "--kata-stage-3": mantineTheme.colors.indigo[1],
    "--kata-setpoint": TRACES.light.setpoint,
    "--kata-measured": TRACES.light.measured,
    "--kata-torque": TORQUE.light.fill,
    "--kata-on-torque": TORQUE.light.text,
  },
  dark: {
    "--mantine-color-dimmed": mantineTheme.colors.dark[1],
    "--mantine-color-placeholder": mantineTheme.colors.dark[1],
    "--mantine-color-error": mantineTheme.colors.grape[3],
    // A disabled button has a background on a card too.
    "--mantine-color-disabled": mantineTheme.colors.dark[5],
    "--mantine-color-disabled-color": mantineTheme.colors.dark[2],
    "--mantine-color-anchor": mantineTheme.colors.indigo[3],
    "--mantine-primary-color-light-color": mantineTheme.colors.indigo[2],
    "--mantine-color-indigo-light-color": mantineTheme.colors.indigo[2],
    "--mantine-color-grape-light-color": mantineTheme.colors.grape[2],
    "--mantine-color-gray-light-color": mantineTheme.colors.gray[3],
    "--mantine-color-indigo-outline": mantineTheme.colors.indigo[3],
    "--kata-brand": mantineTheme.colors.indigo[2],
    "--kata-hover": mantineTheme.colors.dark[6],
    "--kata-chosen": mantineTheme.colors.dark[5],
    "--kata-chosen-edge": mantineTheme.colors.indigo[3],
    "--kata-quiet": mantineTheme.colors.dark[5],
    "--kata-limb": mantineTheme.colors.dark[2],
    "--kata-stale": STALE.dark,
    "--kata-control-edge": CONTROL_EDGE.dark,
    "--kata-shadow": "255 255 255",
    "--kata-stage-1": mantineTheme.colors.dark[5],
    "--kata-stage-2": mantineTheme.colors.dark[4],
    "--kata-stage-3": mantineTheme.colors.indigo[9],
    "--kata-setpoint": TRACES.dark.setpoint,
    "--kata-measured": TRACES.dark.measured,
    "--kata-torque": TORQUE.dark.fill,
    "--kata-on-torque": TORQUE.dark.text,
  },
});

/** Colours of the edge of fields, check boxes and radio buttons, at least 3:1 (WCAG 1.4.11). page.css uses them. */
export const CONTROL_EDGE = { light: "#767d84", dark: "#909090" } as const;

/** Fill and words of a station with torque: the fill at least 3:1 on the page, the words 4.5:1 on the fill. */
export const TORQUE = {
  light: { fill: "#3b5bdb", text: "#ffffff" },
  dark: { fill: "#91a7ff", text: "#1f1f1f" },
} as const;

/** Colours of outdated words, at least 4.5:1 on the page and on a card (WCAG 1.4.3). */
export const STALE = { light: "#666d74", dark: "#9a9a9a" } as const;

/**
 * Colours of traces. They can be distinguished with colour blindness, and none is an alarm colour. The
 * service's figures use the light ones.
 */
export const TRACES = {
  light: { setpoint: "#1f3a93", measured: "#d67500" },
  dark: { setpoint: "#9db2ff", measured: "#ff9a3c" },
} as const;
