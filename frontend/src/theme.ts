import { createTheme } from "@mantine/core";

// Red, yellow and cyan are alarm colours (IEC 60601-1-8); nothing else wears them, but for Stop itself.
export const theme = createTheme({
  primaryColor: "indigo",
  primaryShade: 8,
  fontFamily: "system-ui, 'Segoe UI', Roboto, 'Noto Sans', 'Noto Sans CJK JP', sans-serif",
  defaultRadius: "md",
  components: {
    // Below the header, which keeps Stop in reach.
    Modal: { defaultProps: { yOffset: 140 } },
    Button: { defaultProps: { size: "md" } },
    TextInput: { defaultProps: { size: "md" } },
    Select: { defaultProps: { size: "md" } },
    Textarea: { defaultProps: { size: "md" } },
  },
});

/** Traces: told apart by everybody, and none in an alarm colour. The figures of the service use the same. */
export const TRACES = { setpoint: "#1f3a93", measured: "#e07b00" } as const;
