import { useMediaQuery } from "@mantine/hooks";

/** Return true on a telephone, where the clinic's figures take several screens. */
export const useOnTelephone = () =>
  useMediaQuery("(max-width: 47.99em)", undefined, { getInitialValueInEffect: false });
