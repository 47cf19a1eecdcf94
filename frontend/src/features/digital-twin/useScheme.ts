import { useComputedColorScheme } from "@mantine/core";

/** Return the scheme from the first rendering on, because the first picture is drawn in its colours. */
export const useScheme = () => useComputedColorScheme("light", { getInitialValueInEffect: false });
